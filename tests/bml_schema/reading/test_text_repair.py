"""Tests of the repair of what is spoken in a document that is not well-formed."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, BMLError, Speech, parse, read
from bml_schema.reading.text_repair import repaired
from tests.rows import each_row

SPEECH = '<bml id="b"><speech id="s"><text>{}</text></speech><head id="h" lexeme="NOD"/></bml>'


def words(document: str) -> str:
    speech = parse(document)["s"]
    assert isinstance(speech, Speech)
    return str(speech.text)


@each_row(
    "content, read, said",
    [
        ("<p>Tom & 5 < 6, <3", "<p>Tom &amp; 5 &lt; 6, &lt;3</p>", "Tom & 5 < 6, <3"),
        ("<p>caf&eacute; &nobody; &#65;", "<p>café &amp;nobody; A</p>", "café &nobody; A"),
        ("a <emphasis>b", "a <emphasis>b</emphasis>", "a b"),
        ("a <p><s>b</p> c", "a <p><s>b</s></p> c", "a b c"),
        ("a</emphasis> b", "a b", "a b"),
        ("a <break time=1s> b", 'a <break time="1s"/> b', "a  b"),
        ('a <emphasis level="x>b</emphasis>', "a <emphasis>b</emphasis>", "a b"),
        ('a <voice name="x y">b', 'a <voice name="x y">b</voice>', "a b"),
        ('a <sync id="m">b', 'a <sync id="m"/>b', "a b"),
        ("a <x:emphasis>b</x:emphasis> &", "a <emphasis>b</emphasis> &amp;", "a b &"),
    ],
)
def test_repaired_keeps_the_words(content: str, read: str, said: str) -> None:
    document, note = repaired(SPEECH.format(content))
    assert document == SPEECH.format(read)
    assert note == f"<text> is not well-formed: read as {read!r}"
    assert words(SPEECH.format(content)) == said
    assert parse(SPEECH.format(content)).problems


def test_repaired_leaves_what_is_well_formed() -> None:
    document = SPEECH.format('a <emphasis level="strong">b</emphasis> &amp; <!-- c --> d')
    assert repaired(document) == (document, "")


@each_row(
    "document, said",
    [
        ('<bml id="b"><speech id="s"><text>Hi</text></speech><head id="h" lexeme=NOD/></bml>', "Hi"),
        ('<bml id="b"><speech id="s"><text>Hi there</speech></bml>', "Hi there"),
        ('<bml id="b"><speech id="s"><text>Hello', "Hello"),
        ('<bml id="b"><speech id="s"><text>Hi</text></speech><head id="h" lexeme="NOD">', "Hi"),
        ('<bml id="b"><x:speech id="s"><x:text>Hi & bye</x:text></x:speech></bml>', "Hi & bye"),
    ],
)
def test_words_are_read_whatever_else_is_not_well_formed(document: str, said: str) -> None:
    assert words(document) == said
    assert parse(document).problems[0].type == "NOT_BML_1_0"
    with pytest.raises(BMLError):
        parse(document, strict_bml=True)


def test_a_broken_document_without_words_is_refused() -> None:
    with pytest.raises(BMLError, match="not well-formed"):
        parse('<bml id="b"><head id="h" lexeme=NOD/></bml>')


@given(
    st.lists(
        st.sampled_from(
            ["one", " ", "<p>", "</p>", "<emphasis", ">", "&", "<", "</", "'", '"', "<sync/>", "/>"]
        )
    )
)
def test_repaired_content_is_always_well_formed(pieces: list[str]) -> None:
    (block,) = read(SPEECH.format("Say " + "".join(pieces)))
    assert isinstance(block, Block)
    assert "Say" in words(SPEECH.format("Say " + "".join(pieces)))


@each_row("piece", ["<text>", "<", "&", "<p>", "</p>", "<p a=", "</text>", "<speak>"])
def test_repaired_is_linear(piece: str) -> None:
    def cost(count: int) -> float:
        began = time.process_time()
        repaired(SPEECH.format(piece * count))
        return time.process_time() - began

    cost(100)
    assert cost(40_000) < 40 * cost(4_000) + 0.2
