"""A text that comes piece by piece is spoken sentence by sentence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.speech.sentence_splitter import SentenceSplitter


def cut(text: str, *, close: bool = True) -> list[str]:
    """What is given out where the text comes letter by letter."""
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
def test_sentences_end_where_people_end_them(text, pieces) -> None:
    assert cut(text) == pieces


def test_a_sentence_is_spoken_when_a_blank_follows_it_and_not_before() -> None:
    clauses = SentenceSplitter()
    assert clauses.feed("Hello the") == []
    assert clauses.feed("re.") == []
    assert clauses.feed(" How") == ["Hello there."]
    assert clauses.feed("", close=True) == [" How"]


def test_tags_behind_a_sentence_are_part_of_it_and_those_behind_a_blank_are_not() -> None:
    assert cut('One.<sync id="a"/> Two. <head id="n"/>Three.') == [
        'One.<sync id="a"/>',
        "Two.",
        '<head id="n"/>Three.',
    ]


def test_an_element_is_never_divided() -> None:
    text = (
        'So <emphasis level="strong">this. And that. </emphasis>it is. '
        '<face id="f"><lexeme a=". "/></face> End'
    )
    assert cut(text) == [
        'So <emphasis level="strong">this. And that. </emphasis>it is.',
        '<face id="f"><lexeme a=". "/></face> End',
    ]


def test_the_first_piece_may_be_a_clause_and_long_sentences_are_divided() -> None:
    clause = "when all of them had come to the old house by the sea, "
    pieces = cut(clause * 12)
    assert pieces[0] == clause.strip()
    assert len(pieces) > 2
    assert all(len(p) < 300 for p in pieces)
    assert all(len(p) <= 610 for p in cut("word " * 1000))


@given(st.lists(st.text(alphabet='ab.,!? <>/"=\n', max_size=12), max_size=12))
def test_the_pieces_together_are_the_text(parts) -> None:
    clauses = SentenceSplitter()
    pieces = [piece for part in parts for piece in clauses.feed(part)] + clauses.feed("", close=True)
    assert "".join("".join(pieces).split()) == "".join("".join(parts).split())
