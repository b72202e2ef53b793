"""Times of words and phonemes from the readings of hibari."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.speech.hibari.times import (
    KEPT_OF_LAST,
    Sound,
    guess_lengths,
    signs_of,
    sounds,
    trim_to_sound,
    word_spans,
)


def test_sounds_add_stress_signs_to_vowels_and_divide_blanks() -> None:
    sentence = [("Hi", "hˈI", True), ("you", "jˌu", False), (".", ".", False)]
    found = sounds(sentence, [10, 2, 3, 4, 4, 5, 6, 7, 8, 9])
    assert [(s.ipa, s.stress, s.start, s.end, s.token) for s in found] == [
        ("", 0, 0, 10, 0),
        ("h", 0, 10, 12, 0),
        ("aɪ", 1, 12, 21, 0),
        ("j", 0, 21, 28, 1),
        ("u", 2, 28, 41, 1),
        ("", 0, 41, 58, 2),
    ]


def test_word_spans_divide_expanded_words_by_their_sounds() -> None:
    tokens = [("at", "æt", True), ("seven", "sɛvən", True), ("P.M.", "piɛm", True), ("now", "nW", False)]
    heard = sounds(tokens, [0] + [1] * 16 + [0])
    alone = {"at": "æt", "7": "sɛvən", "pm": "piɛm"}
    separate = []

    def spoken(words: object) -> list[tuple[str, ...]]:
        separate.append(words)
        return [tuple(alone[word]) for word in words]  # type: ignore[attr-defined]

    found = word_spans(["at", "7", "pm", "now"], tokens, heard, spoken)
    assert ["".join(s.ipa for s in heard[a:b]) for a, b in found] == ["æt", "sɛvən", "piɛm", "naʊ"]
    assert separate == [["at", "7", "pm"]]


def test_word_spans_are_empty_for_words_without_sounds() -> None:
    heard = sounds([("one", "wʌn", False)], [0, 1, 1, 1, 0])
    assert word_spans(["one", "?"], [("one", "wʌn", False)], heard, lambda words: [("w",), ()]) == [
        (0, 3),
        (3, 3),
    ]
    assert word_spans(["one"], [], [], lambda words: []) == [(0, 0)]


def test_trim_to_sound_lets_pauses_start_where_silence_does() -> None:
    pcm = np.zeros(100, np.int16)
    pcm[:30] = 1000
    found = trim_to_sound([Sound("a", 0, 0, 60, 0), Sound("", 0, 60, 100, 0)], pcm)
    assert [(s.start, s.end) for s in found] == [(0, 30), (30, 100)]
    pcm[:] = 0  # never less than a part of the sound
    found = trim_to_sound([Sound("a", 0, 0, 60, 0), Sound("", 0, 60, 100, 0)], pcm)
    assert found[0].end == round(KEPT_OF_LAST * 60) == found[1].start


def test_guess_lengths_divides_the_audible_part() -> None:
    pcm = np.zeros(100, np.int16)
    pcm[10:90] = 5000
    sentence = [("aka", "aka", False)]
    lead, *signs, tail = guess_lengths(sentence, pcm)
    assert lead + sum(signs) + tail == len(pcm)
    assert (lead, tail) == (10, 10)
    assert signs[0] == pytest.approx(signs[2], abs=1)
    assert signs[0] > signs[1]
    assert guess_lengths([("", "", False)], pcm) == [0, 100]


def test_signs_of_a_sentence_end_without_a_blank() -> None:
    assert signs_of([("a", "ɐ", True), ("cat", "kæt", True)]) == ("ɐ kæt", (0, 0, 1, 1, 1))
    assert signs_of([("a", "ɐ", False), ("cat", "kæt", True)]) == ("ɐkæt", (0, 1, 1, 1))
