"""Recordings with known times as utterances."""

from itertools import pairwise

import numpy as np
import pytest

from realizer.animation.lips.lip_sync import lip_channels
from realizer.animation.lips.visemes import sounds
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.recorded.recorded_speech import by_loudness, sound_of, utterance_of
from realizer.speech.registry import find_voice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, Recording, SpeechRequest, Word

RATE = 16000
# After a quarter of a second of silence, without which it would be a hum.
SOUND = np.rint(8000 * np.sin(np.arange(2 * RATE) * 0.1) * (np.arange(2 * RATE) > RATE / 4)).astype(np.int16)
TEXT = SpeechRequest('One <mark name="m"/>two, three', ("m",))
WORDS = (Word(0.2, 0.5, "One"), Word(1.0, 1.3, "two,"), Word(1.3, 1.8, "three"))


def said(request: SpeechRequest = TEXT, **fields):
    recording = Recording(RATE, SOUND, **fields)
    return speak_to_length(SilentVoice(), SpeechRequest(request.ssml, request.marks, recording=recording))


def test_utterance_of_places_marks_by_known_words() -> None:
    utterance = said(words=WORDS)
    assert utterance.words == WORDS
    words = {"word-1": 0.2, "word-2": 1.0, "word-3": 1.3}
    assert utterance.marks == words | {"m": pytest.approx(1.0, abs=1e-3)}
    assert utterance.duration == 2.0
    assert utterance.pcm is SOUND


def test_utterance_of_adds_phonemes_to_known_words() -> None:
    phonemes = said(words=WORDS).phonemes
    assert (phonemes[0].start, phonemes[-1].end) == (0.0, 2.0)
    assert all(a.end == b.start for a, b in pairwise(phonemes))
    for p in (p for p in phonemes if p.ipa):
        middle = (p.start + p.end) / 2
        assert any(w.start <= middle <= w.end for w in WORDS)


def test_utterance_of_matches_words_by_letters() -> None:
    parts = (Word(0.2, 0.3, "O"), Word(0.3, 0.5, "ne"), Word(0.5, 0.6, ","), *WORDS[1:])
    assert said(words=parts).marks["m"] == pytest.approx(1.0, abs=1e-3)


def test_utterance_of_keeps_known_phonemes() -> None:
    utterance = said(phonemes=(Phoneme(0.5, 0.6, "p"), Phoneme(0.6, 1.8, "a"), Phoneme(1.8, 9.0, "")))
    assert [(p.start, p.end, p.ipa) for p in utterance.phonemes] == [
        (0.0, 0.5, ""),
        (0.5, 0.6, "p"),
        (0.6, 1.8, "a"),
        (1.8, 2.0, ""),
    ]
    assert [w.text for w in utterance.words] == ["One", "two", "three"]
    assert 0.5 < utterance.marks["m"] < 1.8


@pytest.mark.espeak
def test_utterance_of_sound_alone_recognises_mouth_shapes() -> None:
    pytest.importorskip("espeakng_loader")
    voice = find_voice("espeak")
    spoken = voice.say(SpeechRequest("Bob may buy a map."))
    voice.close()
    assert spoken.pcm is not None
    utterance = utterance_of(SpeechRequest(""), Recording(spoken.sample_rate, spoken.pcm))
    assert utterance.words == ()
    assert {"p", "a", "ɪ"} < {p.ipa for p in utterance.phonemes}
    assert (utterance.phonemes[0].start, utterance.phonemes[-1].end) == (0.0, utterance.duration)


def test_utterance_of_sound_alone_uses_what_was_heard() -> None:
    heard = (Phoneme(0.0, 1.0, "p"), Phoneme(1.0, 2.0, "a"))
    assert said(SpeechRequest(""), heard=heard).phonemes == heard


def test_utterance_of_sound_that_is_no_speech_uses_loudness() -> None:
    utterance = utterance_of(SpeechRequest(""), Recording(4000, SOUND))  # no consonant has so low a rate
    assert {p.ipa for p in utterance.phonemes} == {"", "a"}
    assert said(SpeechRequest(""), heard=(Phoneme(0.0, 2.0, ""),)).phonemes == by_loudness(SOUND, RATE)


def openings(pcm: np.ndarray) -> list[tuple[float, float]]:
    """Return (start, end) of the phonemes of a sound alone that are no pauses."""
    recording = Recording(RATE, np.rint(pcm).astype(np.int16))
    return [(p.start, p.end) for p in utterance_of(SpeechRequest(""), recording).phonemes if p.ipa]


NOISE = 300 * np.random.default_rng(1).standard_normal(RATE)
TIME = np.arange(RATE) / RATE
HUM = sum(1000 / k * np.sin(2 * np.pi * 50 * k * TIME) for k in range(1, 8))


@pytest.mark.parametrize("background", [NOISE / 10, NOISE, 10 * NOISE, HUM, HUM / 30, NOISE + HUM])
def test_utterance_of_noise_and_hum_keeps_the_mouth_closed(background: np.ndarray) -> None:
    assert openings(background) == []


@pytest.mark.parametrize("background", [NOISE, HUM])
def test_utterance_of_speech_in_noise_moves_the_mouth_while_it_lasts(background: np.ndarray) -> None:
    pytest.importorskip("espeakng_loader")
    voice = find_voice("espeak")
    spoken = voice.say(SpeechRequest("Bob may buy a map of the town."))
    voice.close()
    assert spoken.pcm is not None
    rate, pcm = spoken.sample_rate, spoken.pcm.astype(float)
    speech = np.interp(np.arange(0, spoken.duration, 1 / RATE), np.arange(len(pcm)) / rate, pcm)
    around = np.tile(background, 5)[: len(speech) + 2 * RATE]
    around[RATE : RATE + len(speech)] += speech
    spans = openings(around)
    assert sum(end - start for start, end in spans) > 0.6 * spoken.duration
    assert min(start for start, _ in spans) > 0.6
    assert max(end for _, end in spans) < 1.4 + spoken.duration


def test_utterance_of_text_without_times_is_aligned() -> None:
    utterance = said(SpeechRequest("One two three"))
    assert [w.text for w in utterance.words] == ["One", "two", "three"]


def tone(*parts: tuple[float, float]) -> np.ndarray:
    """A tone in parts of (seconds, how loud 0..1)."""
    pieces = [level * np.sin(np.arange(round(s * RATE)) * 0.1) for s, level in parts]
    return np.rint(20000 * np.concatenate(pieces)).astype(np.int16)


def test_by_loudness_opens_in_loud_parts() -> None:
    phonemes = by_loudness(tone((0.4, 1.0), (0.4, 0.0), (0.4, 0.1)), RATE)
    assert [p.ipa for p in phonemes] == ["a", "", "ə"]
    assert phonemes[0].start == 0.0
    assert phonemes[1].start == 0.4
    assert phonemes[-1].end == 1.2


def test_by_loudness_covers_a_sound_of_any_length() -> None:
    pcm = tone((0.213, 1.0), (0.1, 0.3))
    phonemes = by_loudness(pcm, RATE)
    assert all(a.end == b.start for a, b in pairwise(phonemes))
    assert phonemes[-1].end == len(pcm) / RATE


def test_by_loudness_ignores_the_overall_level() -> None:
    pcm = tone((0.4, 1.0), (0.4, 0.15))
    assert by_loudness(pcm, RATE) == by_loudness((pcm // 8).astype(np.int16), RATE)


def test_by_loudness_of_silence_is_empty() -> None:
    assert by_loudness(np.zeros(RATE, np.int16), RATE) == ()
    assert by_loudness(np.zeros(0, np.int16), RATE) == ()


def test_by_loudness_opens_the_jaw() -> None:
    channels = lip_channels(by_loudness(tone((0.3, 0.0), (0.4, 1.0), (0.3, 0.0)), RATE), 0.0)
    jaw = next(c for c in channels if c.target.name == "open_jaw")
    assert np.interp(0.5, jaw.times, jaw.values) > 5 * max(np.interp(0.1, jaw.times, jaw.values), 1.0)


@pytest.mark.parametrize(
    ("words", "faults"),
    [
        (WORDS, ()),
        ((*WORDS, Word(2.05, 2.2, "now")), ()),
        (
            (*WORDS, Word(7, 8, "so"), Word(8, 9, "late")),
            ("wanted words that begin within the 2.00 s of the sound, got 'so' at 7.00 s, and 1 more",),
        ),
        (
            (Word(0.2, 0.5, "One"), Word(1.0, 0.6, "two"), Word(1.3, 1.8, "three")),
            ("wanted words that begin before they end, got 'two' from 1.00 s to 0.60 s",),
        ),
        (
            (Word(0.2, 0.9, "One"), Word(0.5, 1.0, "two")),
            ("wanted words that follow each other, got 'One' up to 0.90 s and 'two' from 0.50 s on",),
        ),
    ],
)
def test_utterance_of_warns_of_words_in_wrong_places(words, faults) -> None:
    assert said(words=words).warnings == faults


PHONEMES = (Phoneme(0.2, 0.5, "m"), Phoneme(0.5, 0.8, "a"), Phoneme(0.8, 1.0, ""))
LATE = "wanted phonemes or visemes that begin within the 2.00 s of the sound, got "


@pytest.mark.parametrize(
    ("phonemes", "fault"),
    [
        ((*PHONEMES, Phoneme(1.0, 1.2, "m"), Phoneme(7, 8, "a")), LATE + "'a' at 7.00 s"),
        (
            (*PHONEMES, Phoneme(1.0, 1.2, "m"), Phoneme(1.1, 1.2, "a")),
            "wanted phonemes or visemes that follow each other, got 'm' up to 1.20 s and 'a' from 1.10 s on",
        ),
        (
            (*PHONEMES, Phoneme(1.2, 1.0, "m")),
            "wanted phonemes or visemes that begin before they end, got 'm' from 1.20 s to 1.00 s",
        ),
        ((*PHONEMES, Phoneme(1, 1.2, "?!")), "wanted phonemes in IPA, or \"\" for a pause, got '?!'"),
    ],
)
def test_utterance_of_warns_of_a_wrong_phoneme_and_uses_the_others(phonemes, fault) -> None:
    utterance = said(phonemes=phonemes)
    assert utterance.warnings == (fault,)
    assert [p for p in utterance.phonemes if p.ipa][:2] == list(PHONEMES[:2])


@pytest.mark.parametrize(
    ("phonemes", "fault"),
    [
        (
            (Phoneme(0, 4, "m"), Phoneme(4, 8, "a"), Phoneme(8, 9, "m")),
            LATE + "'a' at 4.00 s, and 1 more",
        ),
        ((Phoneme(0.5, 1, "7"),), "wanted phonemes in IPA, or \"\" for a pause, got '7'"),
        (
            (Phoneme(0.9, 0.4, "m"),),
            "wanted phonemes or visemes that begin before they end, got 'm' from 0.90 s to 0.40 s",
        ),
    ],
)
def test_utterance_of_wrong_phonemes_uses_words_text_or_sound(phonemes, fault) -> None:
    unused = "these phonemes or visemes are not used"
    with_words = said(words=WORDS, phonemes=phonemes)
    assert with_words.warnings == (fault, unused)
    assert with_words.phonemes == said(words=WORDS).phonemes
    with_text = said(phonemes=phonemes)
    assert with_text.warnings[:2] == (fault, unused)
    assert with_text.phonemes == said().phonemes
    by_sound = said(SpeechRequest(""), phonemes=phonemes)
    assert by_sound.warnings == (fault, unused)
    assert by_sound.phonemes == by_loudness(SOUND, RATE)


def test_utterance_of_wrong_words_aligns_the_text() -> None:
    utterance = said(words=(Word(4, 5, "One"), Word(5, 9, "two")))
    late = "wanted words that begin within the 2.00 s of the sound, got 'One' at 4.00 s, and 1 more"
    assert utterance.warnings[:2] == (late, "these words are not used")
    assert utterance.phonemes == said().phonemes


def test_utterance_of_takes_times_far_outside_as_milliseconds() -> None:
    in_seconds = said(words=WORDS, phonemes=PHONEMES)
    words = tuple(Word(1000 * w.start, 1000 * w.end, w.text) for w in WORDS)
    phonemes = tuple(Phoneme(1000 * p.start, 1000 * p.end, p.ipa) for p in PHONEMES)
    utterance = said(words=words, phonemes=phonemes)
    assert [(w.text, pytest.approx(w.start)) for w in WORDS] == [(w.text, w.start) for w in utterance.words]
    assert [p.ipa for p in utterance.phonemes] == [p.ipa for p in in_seconds.phonemes]
    assert ["taken as milliseconds" in warning for warning in utterance.warnings] == [True, True]


def test_utterance_of_counts_a_phoneme_with_two_faults_once() -> None:
    assert "not used" not in " ".join(said(phonemes=(*PHONEMES, Phoneme(8, 9, "7"))).warnings)


def test_utterance_of_pauses_alone_stays_silent() -> None:
    utterance = said(phonemes=(Phoneme(0, 1, ""), Phoneme(1, 900, " ")))
    assert utterance.warnings == ()


def test_viseme_sets_have_silence_and_closed_lips() -> None:
    closed = {"mpeg4": "1", "oculus": "PP", "sapi": "21", "polly": "p"}
    silence = {"mpeg4": "0", "oculus": "sil", "sapi": "0", "polly": "sil"}
    for name in closed:
        assert sound_of(name, closed[name]) == "p"
        assert sound_of(name, silence[name]) == ""


@pytest.mark.parametrize("viseme", range(1, 15))
def test_sound_of_an_mpeg4_viseme_has_that_viseme(viseme: int) -> None:
    parts = sounds(sound_of("mpeg4", str(viseme)))[0].mix
    assert max(parts, key=lambda part: part[1])[0] == viseme


def test_sound_of_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(KeyError, match="polly"):
        sound_of("azure", "1")
    with pytest.raises(KeyError, match="PP"):
        sound_of("oculus", "22")
