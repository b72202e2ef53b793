"""Splitting of text that arrives in chunks into sentences."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.speech.sentence_splitter import SentenceSplitter


def cut(text: str, *, close: bool = True) -> list[str]:
    """Return the pieces of a text that is fed letter by letter."""
    clauses = SentenceSplitter()
    pieces = [piece for letter in text for piece in clauses.feed(letter)]
    return [p.strip() for p in (pieces + (clauses.feed("", close=True) if close else []))]


@pytest.mark.parametrize(
    ("text", "pieces"),
    [
        ("Hello there. How are you? Fine!", ["Hello there.", "How are you?", "Fine!"]),
        ("Dr. Smith came at 3.14 p. m. today. So?", ["Dr. Smith came at 3.14 p. m. today.", "So?"]),
        ('He said "No." Then he left...  Why?!', ['He said "No."', "Then he left...", "Why?!"]),
        ("1. First of all.\n2. Then.", ["1. First of all.", "2. Then."]),
        ("A heading\n\nand a text", ["A heading", "and a text"]),
        ("今日は。お元気ですか？はい", ["今日は。", "お元気ですか？", "はい"]),
        ("x < y and 3 > 2. Done", ["x < y and 3 > 2.", "Done"]),
        ("   ", []),
    ],
)
def test_feed_splits_sentences(text, pieces) -> None:
    assert cut(text) == pieces


def test_feed_waits_for_white_space_after_a_sentence() -> None:
    clauses = SentenceSplitter()
    assert clauses.feed("Hello the") == []
    assert clauses.feed("re.") == []
    assert clauses.feed(" How") == ["Hello there."]
    assert clauses.feed("", close=True) == [" How"]


def test_feed_does_not_split_behind_the_semicolon_of_an_entity() -> None:
    text = "Whatever we may have said of white salt &amp; pepper; we did not mean it like that, you know"
    assert cut(text)[0] == "Whatever we may have said of white salt &amp; pepper;"


def test_feed_keeps_tags_directly_behind_a_sentence() -> None:
    assert cut('One.<sync id="a"/> Two. <head id="n"/>Three.') == [
        'One.<sync id="a"/>',
        "Two.",
        '<head id="n"/>Three.',
    ]


def test_feed_never_splits_an_element() -> None:
    text = (
        'So <emphasis level="strong">this. And that. </emphasis>it is. '
        '<face id="f"><lexeme a=". "/></face> End'
    )
    assert cut(text) == [
        'So <emphasis level="strong">this. And that. </emphasis>it is.',
        '<face id="f"><lexeme a=". "/></face> End',
    ]


def test_feed_does_not_wait_for_the_end_of_what_is_no_tag() -> None:
    clauses = SentenceSplitter()
    assert clauses.feed("So <sync id='m' there. And so") == ["So <sync id='m' there."]
    assert SentenceSplitter().feed("So <sync id='m' ref = \"a. b. ") == []


@pytest.mark.parametrize("tag", ["<sync id='m'>", "<br>"])
def test_feed_does_not_wait_for_the_end_of_an_element_without_content(tag: str) -> None:
    assert SentenceSplitter().feed(f"So {tag}there. And so") == [f"So {tag}there."]


def test_feed_splits_first_and_long_sentences_into_clauses() -> None:
    clause = "when all of them had come to the old house by the sea, "
    pieces = cut(clause * 12)
    assert pieces[0] == clause.strip()
    assert len(pieces) > 2
    assert all(len(p) < 300 for p in pieces)
    assert all(len(p) <= 610 for p in cut("word " * 1000))


@given(st.lists(st.text(alphabet='ab.,!? <>/"=\n', max_size=12), max_size=12))
def test_feed_returns_the_whole_text_in_pieces(parts) -> None:
    clauses = SentenceSplitter()
    pieces = [piece for part in parts for piece in clauses.feed(part)] + clauses.feed("", close=True)
    assert "".join("".join(pieces).split()) == "".join("".join(parts).split())
