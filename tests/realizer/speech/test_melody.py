import numpy as np
import pytest

from realizer.speech.accents import prosody_facts
from realizer.speech.melody import RATE, melody, quantile, with_loudness
from realizer.speech.utterance import Phoneme, Utterance, Word


def utterance(pcm=None, rate=0, phonemes=(), duration=None):
    length = duration if duration is not None else len(pcm) / rate
    return Utterance(length, (Word(0.0, length, "word"),), tuple(phonemes), {}, rate, pcm)


def tone(hertz, rate=22050, volume=8000.0):
    """A voice-like sound whose frequency follows an array of values, one a sample."""
    phase = 2 * np.pi * np.cumsum(hertz) / rate
    return (volume * sum(np.sin(k * phase) / k for k in (1, 2, 3, 4))).astype(np.int16)


@pytest.mark.parametrize("rate", [8000, 16000, 22050, 44100])
@pytest.mark.parametrize("hertz", [90, 130, 220, 330])
def test_melody_hears_a_rising_tone(rate, hertz) -> None:
    glide = hertz * 2 ** np.linspace(-3 / 12, 3 / 12, 2 * rate)
    heard = melody(utterance(tone(glide, rate), rate))
    times = np.arange(3, 2 * RATE - 4) / RATE
    pitch = heard.pitch[3:][: len(times)]
    assert np.abs(pitch - (3 * times - 3)).max() < 0.7


def test_melody_hears_loudness() -> None:
    loud = np.concatenate([np.full(11025, 0.2), np.full(11025, 1.0), np.zeros(11025)])
    pcm = (tone(np.full(33075, 150.0)) * loud).astype(np.int16)
    heard = melody(utterance(pcm, 22050)).loudness
    at = [heard[round(t * RATE)] for t in (0.25, 0.75, 1.3)]
    assert at == pytest.approx([0.2, 1.0, 0.0], abs=0.06)


def test_melody_keeps_pitch_level_through_silence_and_noise() -> None:
    voice = tone(np.full(11025, 150.0))
    noise = np.random.default_rng(1).normal(0, 500, 11025).astype(np.int16)
    heard = melody(utterance(np.concatenate([voice, 0 * voice, noise, voice]), 22050))
    assert np.abs(heard.pitch).max() < 1.0


@pytest.mark.parametrize("pcm", [None, np.zeros(4000, np.int16)])
def test_melody_without_sound_rises_on_accents(pcm) -> None:
    phonemes = [Phoneme(0.0, 0.2, "h"), Phoneme(0.2, 0.4, "a", 1), Phoneme(0.4, 0.8, "b")]
    silent = melody(utterance(pcm, 4000 if pcm is not None else 0, phonemes, 1.0))
    assert abs(int(silent.pitch.argmax()) / RATE - 0.3) <= 0.05
    assert abs(int(silent.loudness.argmax()) / RATE - 0.3) <= 0.05


def test_melody_of_an_empty_or_tiny_sound_is_level() -> None:
    for duration, samples in ((0.0, 0), (0.01, 220)):
        heard = melody(utterance(np.ones(samples, np.int16), 22050, duration=duration))
        assert np.isfinite(heard.pitch).all()
        assert np.isfinite(heard.loudness).all()


def test_melody_does_not_depend_on_the_closing_silence() -> None:
    voice = tone(np.linspace(100.0, 180.0, 22050))
    phonemes = [Phoneme(0.0, 0.7, "a", 1), Phoneme(0.7, 1.0, "b")]
    for pcm in (voice, None):
        heard = []
        for silence in (0.0, 0.1, 3.0):
            quiet = [Phoneme(1.0, 1.0 + silence, "")] if silence else []
            sound = None if pcm is None else np.concatenate([pcm, np.zeros(round(22050 * silence), np.int16)])
            heard.append(melody(utterance(sound, 22050, [*phonemes, *quiet], 1.0 + silence)))
        assert len({len(one.pitch) for one in heard}) == 1
        assert all((one.pitch == heard[0].pitch).all() for one in heard)
        assert all((one.loudness == heard[0].loudness).all() for one in heard)


SAMPLES = 8000
LOUDER = prosody_facts()["accents"]["louder"]
FACTORS = (1.0, 0.5, 1.0, 2.0, 1.0)  # amplitudes of five vowels


def said(*, stressed: int | None = None, volume: float = 1.0, sound: bool = True) -> Utterance:
    """Five vowels with an s between them."""
    phonemes, pcm = list[Phoneme](), list[np.ndarray]()
    for k, factor in enumerate(FACTORS):
        start = k * 0.2
        phonemes.append(Phoneme(start, start + 0.1, "a", int(k == stressed), volume))
        phonemes.append(Phoneme(start + 0.1, start + 0.2, "s"))
        tone = np.sin(np.arange(SAMPLES // 10) * 0.7)
        pcm += [4000 * factor * tone, 200 * tone]
    made = np.concatenate(pcm).astype(np.int16)
    return Utterance(1.0, (), tuple(phonemes), {}, SAMPLES, made if sound else None)


def volumes(utterance: Utterance) -> list[float]:
    return [p.volume for p in with_loudness(utterance) if p.ipa == "a"]


def test_with_loudness_scales_sounds_by_their_amplitude() -> None:
    found = np.array(volumes(said(stressed=0)))
    assert found / found[4] == pytest.approx([LOUDER, 0.5, 1, 2, 1], rel=0.05)
    hissed = [p.volume for p in with_loudness(said()) if p.ipa == "s"]
    # A twentieth of the usual vowel, but within the range.
    assert hissed == pytest.approx([1 / prosody_facts()["accents"]["range"]] * 5)


def test_with_loudness_scales_no_consonant_without_sound() -> None:
    assert {p.volume for p in with_loudness(said(sound=False)) if p.ipa == "s"} == {1.0}


def test_with_loudness_makes_the_last_accent_of_a_phrase_louder() -> None:
    assert volumes(said(stressed=2, sound=False)) == pytest.approx([1, 1, LOUDER, 1, 1])


def test_with_loudness_multiplies_the_requested_volume() -> None:
    usual, soft = (np.array(volumes(said(stressed=2, volume=volume))) for volume in (1.0, 0.5))
    assert soft == pytest.approx(usual / 2)


def test_with_loudness_leaves_pauses_and_silence_alone() -> None:
    silent = Utterance(
        0.2, (), (Phoneme(0, 0.1, ""), Phoneme(0.1, 0.2, "t")), {}, SAMPLES, np.zeros(1600, np.int16)
    )
    assert with_loudness(silent) is silent.phonemes
    quiet = said(stressed=0)
    quiet = Utterance(1.0, (), quiet.phonemes, {}, SAMPLES, np.zeros(SAMPLES, np.int16))
    assert volumes(quiet) == pytest.approx([LOUDER, 1, 1, 1, 1])


def test_with_loudness_extends_pauses_by_the_silence_beside_them() -> None:
    tone = 4000 * np.sin(np.arange(SAMPLES) * 0.7)
    tone[int(0.3 * SAMPLES) : int(0.6 * SAMPLES)] = 0
    sounds = (("a", 0.0, 0.4), ("", 0.4, 0.5), ("m", 0.5, 0.7), ("", 0.7, 0.8), ("t", 0.8, 1.0))
    utterance = Utterance(
        1.0,
        (),
        tuple(Phoneme(start, end, ipa) for ipa, start, end in sounds),
        {},
        SAMPLES,
        tone.astype(np.int16),
    )
    found = [(p.ipa, p.start, p.end) for p in with_loudness(utterance)]
    assert [ipa for ipa, *_ in found] == ["a", "", "m", "", "t"]
    assert np.array([times for _, *times in found]) == pytest.approx(
        np.array([(0, 0.3), (0.3, 0.6), (0.6, 0.7), (0.7, 0.8), (0.8, 1.0)]), abs=0.011
    )


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_quantile_is_that_of_numpy(kind: type[np.floating], part: float) -> None:
    for count in range(1, 40):
        values = np.random.default_rng(count).uniform(size=count).astype(kind)
        assert quantile(values, part) == pytest.approx(float(np.quantile(values, part)), rel=1e-6)
