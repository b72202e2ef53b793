"""Words, pauses and marks of a script."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.ssml import Mark, read_script
from realizer.speech.utterance import SpeechRequest
from realizer.speech.words import Pause, Token, WordToken, tokens, words_in


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
