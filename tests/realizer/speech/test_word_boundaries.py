"""Boundaries of words in joined phonemes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.word_boundaries import MAX_CELLS, boundaries, divided, is_vowel, strip_marks

SOUNDS = st.sampled_from(["a", "ˈɪ", "iː", "t", "n", "ʃ", "m", "oʊ"])
WORDS = st.lists(st.lists(SOUNDS, max_size=5), min_size=1, max_size=6)


@given(st.lists(st.lists(SOUNDS, min_size=1, max_size=5), min_size=1, max_size=6))
def test_boundaries_of_unchanged_words_are_exact(words: list[list[str]]) -> None:
    joined = [sound for word in words for sound in word]
    found = boundaries(words, joined)
    lengths = [len(word) for word in words]
    assert found == [sum(lengths[:k]) for k in range(len(words))]


@given(WORDS, st.lists(SOUNDS, max_size=20))
def test_boundaries_rise_within_what_is_heard(words: list[list[str]], heard: list[str]) -> None:
    found = boundaries(words, heard)
    assert found == sorted(found)
    assert found[0] == 0
    assert all(0 <= k <= len(heard) for k in found)
    assert len(found) == len(words)


def test_boundaries_allow_other_and_missing_sounds() -> None:
    assert boundaries([["ð", "ə"], ["h", "aʊ", "s"]], ["ð", "ɪ", "h", "aʊ", "z"]) == [0, 2]
    assert boundaries([["aɪ"], ["æ", "m"], ["h", "ɪ", "ɹ"]], ["aɪ", "m", "h", "ɪ", "ɹ"]) == [0, 1, 2]


def test_boundaries_prefer_hints_where_words_are_ambiguous() -> None:
    words, heard = [["a", "m"], ["e"]], ["o", "o", "o"]
    assert [boundaries(words, heard, [hint])[1] for hint in (1, 2)] == [1, 2]


def test_boundaries_of_long_texts_are_shares() -> None:
    words = [["a"] * 100, ["b"] * 300]
    heard = ["a"] * (MAX_CELLS // 400 + 1)
    assert boundaries(words, heard) == [0, round(len(heard) / 4)]


def test_divided_returns_the_items_of_each_word() -> None:
    assert divided([3, 4, 6], [["aɪ"], ["æ", "m"]], ["aɪ", "æ", "m"]) == [[3], [4, 6]]
    assert divided([3, 4, 6], [()], ["aɪ", "æ", "m"]) == [[3, 4, 6]]


def test_strip_marks_removes_stress_and_length() -> None:
    assert [strip_marks(ipa) for ipa in ("ˈiː", "ˌoʊ", "t", "_ˈaː")] == ["i", "oʊ", "t", "a"]


def test_is_vowel_looks_at_the_first_letter() -> None:
    assert [is_vowel(ipa) for ipa in ("aɪ", "ə", "t", "")] == [True, True, False, False]
