"""Words, pauses and marks of a script."""

import pytest
import regex
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.ssml import Mark, read_script
from realizer.speech.utterance import SpeechRequest
from realizer.speech.words import (
    MAX_CELLS,
    Pause,
    Token,
    WordToken,
    boundaries,
    divided,
    is_vowel,
    strip_marks,
    tokens,
    words_in,
)


def tokens_of(ssml: str) -> tuple[Token, ...]:
    return tokens(read_script(SpeechRequest(ssml)), ".,!?")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("don't stop", ["don't", "stop"]),
        ("well-known U.S.A. 7:30", ["well-known", "U.S.A", "7:30"]),
        ("1,250.5 €, 20%", ["1,250.5", "€", "20", "%"]),
        ("你好 abc", ["你", "好", "abc"]),
        ("a&b @ #1", ["a", "&", "b", "@", "#", "1"]),
        ("नमस्ते दुनिया", ["नमस्ते", "दुनिया"]),
        ("... !?", []),
    ],
)
def test_words_in_finds_spoken_words(text: str, words: list[str]) -> None:
    assert [word for word, _ in words_in(text)] == words


@given(st.text(max_size=60))
def test_words_in_returns_places_in_order(text: str) -> None:
    end = 0
    for word, place in words_in(text):
        assert place >= end
        assert text[place : place + len(word)] == word
        end = place + len(word)


def test_tokens_keep_words_pauses_and_marks_in_order() -> None:
    assert tokens_of('One, <mark name="m"/>two<break time="1s"/>.') == (
        WordToken("One", 0),
        Pause(","),
        Mark("m"),
        WordToken("two", 5),
        Pause("", 1.0),
        Pause("."),
    )


def test_tokens_scale_words_by_nested_prosody() -> None:
    ssml = 'a <prosody rate="fast">b <prosody volume="50">c</prosody></prosody> d'
    words = [token for token in tokens_of(ssml) if isinstance(token, WordToken)]
    assert [(w.text, w.rate, w.volume) for w in words] == [
        ("a", 1.0, 1.0),
        ("b", 1.4, 1.0),
        ("c", 1.4, 0.5),
        ("d", 1.0, 1.0),
    ]


def test_tokens_replace_sub_by_its_alias() -> None:
    texts = [token.text for token in tokens_of('the <sub alias="World Wide Web">WWW</sub> is')]  # type: ignore[union-attr]
    assert texts == ["the", "World", "Wide", "Web", "is"]


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


@pytest.mark.parametrize(
    "text",
    [
        "สวัสดีครับ ผมชื่อ",
        "ສະບາຍດີ",
        "សួស្តី",
        "မင်္ဂလာပါ",
        "が\u3099行\U000e0100く",
        "\u1112\u1161\u11ab글",
        "नमस्ते दुनिया",
        "می\u200cخواهم",
    ],
)
def test_words_never_break_inside_a_letter(text: str) -> None:
    words = [word for word, _ in words_in(text)]
    letters = regex.findall(r"\X", text)
    assert "".join(words) == "".join(text.split())
    assert all("".join(regex.findall(r"\X", word)) == word and word in text for word in words)
    assert sum(len(regex.findall(r"\X", word)) for word in words) == len(
        [one for one in letters if one.strip()]
    )
