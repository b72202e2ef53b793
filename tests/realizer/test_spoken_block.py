"""Blocks of chunks: syncs, SSML, behaviours at their places."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, write
from realizer.spoken_block import Chunk, clip_block, text_block

PIECE = Chunk("turn", 2)


def said(block: Block) -> str:
    return str(block["turn"].text)


def test_text_block_is_a_speech_with_its_syncs() -> None:
    block = text_block('R&D, 1 < 2: <sync id="m"/>"so &amp; so".', PIECE)
    assert block.id == "turn.2"
    assert said(block) == 'R&D, 1 < 2: "so & so".'
    assert block["turn"].marked == ("m",)
    assert block["turn"].descriptions == ()
    assert block.problems == ()


def test_text_block_starts_a_behaviour_at_its_place() -> None:
    block = text_block('<head lexeme="NOD"/>Yes <faceLexeme lexeme="SMILE"/>indeed.', PIECE)
    nod, smile = block["b1"], block["b2"]
    assert nod.syncs["start"].offset == 0
    (mark,) = block["turn"].marked
    assert (smile.syncs["start"].behaviour, smile.syncs["start"].sync) == ("turn", mark)
    assert said(block) == "Yes indeed."


def test_text_block_keeps_references_of_behaviours() -> None:
    block = text_block('Yes <sync id="m"/>indeed. <head id="n" lexeme="NOD" stroke="turn:m"/>', PIECE)
    assert list(block["n"].syncs) == ["stroke"]
    assert block["turn"].marked == ("m",)


def test_text_block_resolves_references_to_earlier_chunks() -> None:
    piece = Chunk("turn", 3, marks={"m": "turn.1"})
    block = text_block('And <head id="n" lexeme="NOD" start="turn:m + 1" end="turn:end"/>so.', piece)
    assert (block["n"].syncs["start"].block, block["n"].syncs["start"].offset) == ("turn.1", 1)
    assert block["n"].syncs["end"].block is None


def test_text_block_keeps_ssml_and_removes_unknown_tags() -> None:
    block = text_block('A <b>bold</b> <emphasis level="strong">word</emphasis> <sync id="m"/>here', PIECE)
    (description,) = block["turn"].descriptions
    assert '<emphasis level="strong">word</emphasis>' in description.content
    assert 'name="m"' in description.content
    assert "bold" in description.content
    assert said(block) == "A bold word here"


def test_text_block_reads_content_and_prefixes() -> None:
    block = text_block(
        'Oh <face><faceLexeme lexeme="SMILE"/></face>no <realizer:emotion name="joy"/>yes', PIECE
    )
    assert {node.id for node in block.behaviours} == {"turn", "b1", "b2"}
    assert block.problems == ()


def test_text_block_of_behaviours_alone_has_no_speech() -> None:
    block = text_block(' <head id="n" lexeme="NOD"/> ', PIECE)
    assert [node.id for node in block.behaviours] == ["n"]


@pytest.mark.parametrize(
    "text", ["<head lexeme='NOD'>Well", "<emphasis>Well", "Well</p>", "<x:head y='1'/>Well"]
)
def test_text_block_speaks_invalid_xml_without_tags(text) -> None:
    assert said(text_block(text, PIECE)).strip() == "Well"


def test_text_block_has_character_and_language() -> None:
    block = text_block("Ja", Chunk("turn", 1, character="Eva", language="de"))
    assert block.character_id == "Eva"
    assert block["turn"].text.language == "de"


def test_clip_block_is_a_speech() -> None:
    assert 'fileName="clip:c1"' in write(clip_block("c1", PIECE))


@given(st.text(alphabet='ab<>/="&;sync \x00\ud800', max_size=60))
def test_text_block_accepts_any_text(text) -> None:
    assert text_block(text, PIECE).id == "turn.2"


@pytest.mark.parametrize("syncs", ['<sync id=""/>', '<sync id="m"/>some <sync id="m"/>', '<sync id="a b"/>'])
def test_text_block_speaks_all_words_despite_invalid_syncs(syncs: str) -> None:
    block = text_block(f'Have {syncs}tea <head id="n" lexeme="NOD" start="1"/>here.', PIECE)
    assert said(block).split()[-2:] == ["tea", "here."]
    assert ["/sync[" in p.path or "sync" in p.text for p in block.problems] == [True]
    assert block["n"].syncs["start"].offset == 1


UNENDED = 'wanted ">" at the end of a tag, got '


@pytest.mark.parametrize(
    "tag", ['<sync id="m', "<sync", "</prosody", '<realizer:emotion name="joy', "<head lex"]
)
def test_text_block_removes_an_incomplete_tag(tag: str) -> None:
    block = text_block(f"Good morning. {tag}", PIECE)
    assert said(block).strip() == "Good morning."
    assert [p.text for p in block.problems] == [f'{UNENDED}"{tag}"']
    assert said(text_block("Is a <b?", PIECE)) == "Is a <b?"


@pytest.mark.parametrize(
    ("markup", "marks", "fault"),
    [
        ("<sync id='m' ", ("m",), UNENDED + "\"<sync id='m' there. \""),
        ('<sync id="m/>', (), UNENDED + '"<sync id="m/>there. "'),
        ("<synk id='m'/>", (), 'wanted <sync>, SSML or a behaviour, got <synk>, did you mean "sync"?'),
        ("<haed/>", (), 'wanted <sync>, SSML or a behaviour, got <haed>, did you mean "head"?'),
        ("<b></b>", (), "wanted <sync>, SSML or a behaviour, got <b>"),
        ("<sync/>", (), 'wanted <sync id="..."/>, got "<sync/>"'),
        ("<sync id=m/>", (), 'wanted <sync id="..."/>, got "<sync id=m/>"'),
        (
            "<sync id='m'/><sync id='m'/>",
            ("m",),
            'sync: wanted an id of its own, got "m" again',
        ),
    ],
)
def test_text_block_warns_of_faults_in_markup_and_keeps_words(markup: str, marks, fault: str) -> None:
    block = text_block(f"Hello {markup}there. ", PIECE)
    assert said(block) == "Hello there. "
    assert block["turn"].marked == marks
    assert [(p.id, p.text, p.dropped) for p in block.problems] == [("turn.2:turn", fault, False)]


def test_text_block_speaks_the_text_in_a_sync() -> None:
    block = text_block("Hello <sync id='m'>x</sync> there.", PIECE)
    assert (said(block), block["turn"].marked) == ("Hello x there.", ("m",))
    assert [p.text for p in block.problems] == ['wanted an empty <sync/>, got the text "x" in it']
    assert not text_block("Hello <sync id='m'> </sync><break></break>there.", PIECE).problems


def test_text_block_warns_of_markup_that_is_no_xml() -> None:
    (problem,) = text_block("Hello <emphasis>there.", PIECE).problems
    assert problem.text == "<speak> is not well-formed: read as 'Hello <emphasis>there.</emphasis>'"


def test_text_block_names_at_most_ten_faults_of_markup() -> None:
    (problem,) = text_block("".join(f"<{'x' * n}/>a" for n in range(2, 99)), PIECE).problems
    assert problem.text.count("wanted") == 10
