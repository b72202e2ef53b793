"""Phrases and accents of speech."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.accents import phrases
from realizer.speech.registry import find_voice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word

TEXT = "Good morning, I am really glad to see you. The door is on the left."


def word_at(utterance: Utterance, time: float) -> str:
    return next(word.text for word in utterance.words if word.start <= time < word.end)


@pytest.mark.parametrize("voice", ["silent", "espeak"])
def test_phrases_end_at_commas_and_full_stops(voice: str) -> None:
    said = find_voice(voice).say(SpeechRequest(TEXT))
    found = phrases(said)
    starts = [word_at(said, phrase.start + 0.02) for phrase in found]
    ends = [word_at(said, phrase.end - 0.03) for phrase in found]
    assert starts == ["Good", "I", "The"]
    assert ends == ["morning", "you", "left"]


@pytest.mark.parametrize("voice", ["silent", "espeak"])
def test_accents_are_on_content_words(voice: str) -> None:
    said = find_voice(voice).say(SpeechRequest(TEXT))
    words = {word_at(said, accent.time) for phrase in phrases(said) for accent in phrase.accents}
    assert words >= {"morning", "really", "left"}
    assert not words & {"I", "am", "to", "you", "The", "is", "on", "the"}


def test_accents_at_the_end_of_phrases_are_nuclear() -> None:
    said = SilentVoice().say(SpeechRequest(TEXT))
    for phrase in phrases(said):
        assert [accent.nuclear for accent in phrase.accents][:-1] == [False] * (len(phrase.accents) - 1)
        assert phrase.accents[-1].nuclear


def test_accents_exclude_secondary_stress() -> None:
    sounds = (Phoneme(0.0, 0.2, "a", 2), Phoneme(0.2, 0.4, "i", 1), Phoneme(0.4, 0.6, "u", 0))
    (phrase,) = phrases(Utterance(0.6, (), sounds, {}))
    assert [accent.time for accent in phrase.accents] == [pytest.approx(0.3)]


def test_accents_without_stress_are_the_loudest_words() -> None:
    rate = 8000
    loudness = np.repeat([1000.0, 9000.0, 1000.0, 8500.0], rate // 2)
    pcm = (loudness * np.sin(2 * np.pi * 200 * np.arange(2 * rate) / rate)).astype(np.int16)
    words = tuple(Word(k / 2, k / 2 + 0.5, f"w{k}") for k in range(4))
    (phrase,) = phrases(Utterance(2.0, words, (), {}, rate, pcm))
    assert [0.5 <= phrase.accents[0].time < 1.0, 1.5 <= phrase.accents[1].time < 2.0] == [True, True]
    assert len(phrase.accents) == 2


def test_accents_without_stress_and_sound_are_the_longest_word() -> None:
    words = (Word(0.0, 0.2, "a"), Word(0.2, 1.0, "giraffe"), Word(1.0, 1.2, "it"))
    (phrase,) = phrases(Utterance(1.2, words, (), {}))
    assert [accent.time for accent in phrase.accents] == [pytest.approx(0.6)]


def test_phrases_do_not_end_in_the_closure_of_a_stop() -> None:
    sounds = (Phoneme(0.0, 0.2, "a", 1), Phoneme(0.2, 0.28, ""), Phoneme(0.28, 0.5, "t"))
    (phrase,) = phrases(Utterance(0.5, (), sounds, {}))
    assert (phrase.start, phrase.end) == (0.0, 0.5)


@pytest.mark.parametrize("text", ["", "...", "   "])
def test_phrases_of_an_empty_text_are_empty(text: str) -> None:
    assert phrases(SilentVoice().say(SpeechRequest(text))) == ()


@given(st.lists(st.sampled_from(["cat", "window", ",", ".", "the", "of", "remember", "!"]), max_size=40))
def test_phrases_are_in_order_and_contain_their_accents(parts: list[str]) -> None:
    said = SilentVoice().say(SpeechRequest(" ".join(parts)))
    end = 0.0
    for phrase in phrases(said):
        assert end <= phrase.start < phrase.end <= said.duration
        end = phrase.end
        times = [accent.time for accent in phrase.accents]
        assert times == sorted(times)
        assert all(phrase.start <= time < phrase.end for time in times)
