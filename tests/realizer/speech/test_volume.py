"""Volumes of <prosody>, in phonemes and in the mouth."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word
from realizer.speech.volume import with_volumes


def volumes(ssml: str, seconds: float | None = None) -> list[set[float]]:
    """The volumes of the phonemes of each word."""
    said = speak_to_length(SilentVoice(), SpeechRequest(ssml, seconds=seconds))
    return [
        {p.volume for p in said.phonemes if p.ipa and w.start <= (p.start + p.end) / 2 < w.end}
        for w in said.words
    ]


def test_with_volumes_changes_words_inside_prosody() -> None:
    assert volumes('one <prosody volume="x-loud">two three</prosody> four') == [{1.0}, {2.0}, {2.0}, {1.0}]
    assert volumes('<prosody volume="+6dB">one</prosody>')[0].pop() == pytest.approx(1.995, abs=0.01)


def test_with_volumes_multiplies_nested_prosody() -> None:
    nested = '<prosody volume="soft">a <prosody volume="50%">b</prosody></prosody>'
    assert volumes(nested) == [{0.5}, {0.25}]


def test_with_volumes_survives_stretching() -> None:
    assert volumes('one <prosody volume="loud">two</prosody>', seconds=2.5) == [{1.0}, {1.4}]


def test_with_volumes_keeps_other_speech() -> None:
    said = SilentVoice().say(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"))
    assert with_volumes(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"), said) is said


def test_with_volumes_scales_indices_of_merged_words() -> None:
    merged = (Word(0.0, 0.4, "I am"), Word(0.4, 0.8, "very glad"))
    sounds = (Phoneme(0.0, 0.4, "a"), Phoneme(0.4, 0.8, "e"), Phoneme(0.8, 1.0, ""))
    said = with_volumes(
        SpeechRequest('I am <prosody volume="loud">very glad</prosody>'), Utterance(1.0, merged, sounds, {})
    )
    assert [p.volume for p in said.phonemes] == [1.0, 1.4, 1.0]


def test_with_volumes_opens_the_mouth_by_volume() -> None:
    jaws = []
    for volume in ("x-soft", "medium", "x-loud"):
        said = speak_to_length(SilentVoice(), SpeechRequest(f'<prosody volume="{volume}">papa car</prosody>'))
        jaws.append(
            max(c.values.max() for c in lip_channels(said.phonemes, 0.0) if c.target.name == "open_jaw")
        )
    assert jaws[0] < 0.8 * jaws[1]
    assert jaws[2] > 1.2 * jaws[1]


@given(st.text(max_size=60), st.integers(0, 5))
def test_with_volumes_keeps_times_and_phonemes(text: str, count: int) -> None:
    words = tuple(Word(k * 0.2, k * 0.2 + 0.2, "x") for k in range(count))
    sounds = tuple(Phoneme(k * 0.1, k * 0.1 + 0.1, "a") for k in range(2 * count))
    say = SpeechRequest(f'<prosody volume="loud">{text}</prosody>')
    said = with_volumes(say, Utterance(count * 0.2, words, sounds, {}))
    assert [(p.start, p.end, p.ipa) for p in said.phonemes] == [(p.start, p.end, p.ipa) for p in sounds]
    assert {p.volume for p in said.phonemes} <= {1.0, 1.4}
