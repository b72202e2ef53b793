"""Loudness: what <prosody volume> asks for reaches the phonemes of its words, and the mouth."""

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


def test_words_inside_are_as_loud_as_it_says_and_the_others_as_ever() -> None:
    assert volumes('one <prosody volume="x-loud">two three</prosody> four') == [{1.0}, {2.0}, {2.0}, {1.0}]
    assert volumes('<prosody volume="+6dB">one</prosody>')[0].pop() == pytest.approx(1.995, abs=0.01)


def test_one_inside_another_multiplies() -> None:
    nested = '<prosody volume="soft">a <prosody volume="50%">b</prosody></prosody>'
    assert volumes(nested) == [{0.5}, {0.25}]


def test_it_stays_when_speech_is_stretched() -> None:
    assert volumes('one <prosody volume="loud">two</prosody>', seconds=2.5) == [{1.0}, {1.4}]


def test_speech_without_it_is_left_alone() -> None:
    said = SilentVoice().say(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"))
    assert with_volumes(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"), said) is said


def test_words_of_a_voice_that_merges_them_are_shared_out_evenly() -> None:
    merged = (Word(0.0, 0.4, "I am"), Word(0.4, 0.8, "very glad"))
    sounds = (Phoneme(0.0, 0.4, "a"), Phoneme(0.4, 0.8, "e"), Phoneme(0.8, 1.0, ""))
    said = with_volumes(
        SpeechRequest('I am <prosody volume="loud">very glad</prosody>'), Utterance(1.0, merged, sounds, {})
    )
    assert [p.volume for p in said.phonemes] == [1.0, 1.4, 1.0]


def test_what_is_shouted_opens_the_mouth_further_than_what_is_whispered() -> None:
    jaws = []
    for volume in ("x-soft", "medium", "x-loud"):
        said = speak_to_length(SilentVoice(), SpeechRequest(f'<prosody volume="{volume}">papa car</prosody>'))
        jaws.append(
            max(c.values.max() for c in lip_channels(said.phonemes, 0.0) if c.target.name == "open_jaw")
        )
    assert jaws[0] < 0.8 * jaws[1]
    assert jaws[2] > 1.2 * jaws[1]


@given(st.text(max_size=60), st.integers(0, 5))
def test_any_text_leaves_times_and_sounds_as_they_were(text: str, count: int) -> None:
    words = tuple(Word(k * 0.2, k * 0.2 + 0.2, "x") for k in range(count))
    sounds = tuple(Phoneme(k * 0.1, k * 0.1 + 0.1, "a") for k in range(2 * count))
    say = SpeechRequest(f'<prosody volume="loud">{text}</prosody>')
    said = with_volumes(say, Utterance(count * 0.2, words, sounds, {}))
    assert [(p.start, p.end, p.ipa) for p in said.phonemes] == [(p.start, p.end, p.ipa) for p in sounds]
    assert {p.volume for p in said.phonemes} <= {1.0, 1.4}
