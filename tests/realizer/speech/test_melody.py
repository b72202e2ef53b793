import numpy as np
import pytest

from realizer.speech.melody import RATE, melody
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
