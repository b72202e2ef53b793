"""Tests of the writer of blocks."""

import math
import re

import pytest
from hypothesis import given

from bml_schema import Behaviour, Block, Description, Head, Speech, SpeechText, SyncRef, Wait, parse, write
from tests.strategies import blocks


@given(blocks())
def test_write_reads_back_as_the_same(block: Block) -> None:
    text = write(block)
    back = parse(text)
    assert back == block, text
    assert not back.problems
    assert write(back) == text
    assert parse(text.encode()) == block


def test_write_is_readable() -> None:
    text = (
        "<bml id='b' characterId='A' composition='append'>"
        "<required><head id='h' end='2' lexeme='NOD' start='1'/></required>"
        "<speech id='s'><text>a <sync id='m'/> b</text></speech><faceFacs id='f' au='1'/>"
        "<constraint id='c'><before ref='s:m+1'><sync ref='h:end'/></before></constraint></bml>"
    )
    assert write(parse(text)) == (
        '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0"'
        ' xmlns:ext="http://www.bml-initiative.org/bml/coreextensions-1.0"'
        ' id="b" characterId="A" composition="APPEND">\n'
        "  <required>\n"
        '    <head id="h" lexeme="NOD" start="1" end="2"/>\n'
        "  </required>\n"
        '  <speech id="s">\n'
        '    <text>a <sync id="m"/> b</text>\n'
        "  </speech>\n"
        '  <ext:faceFacs id="f" au="1"/>\n'
        '  <constraint id="c">\n'
        '    <before ref="s:m + 1">\n'
        '      <sync ref="h:end"/>\n'
        "    </before>\n"
        "  </constraint>\n"
        "</bml>\n"
    )


def test_write_uses_well_known_prefixes() -> None:
    known = "{http://www.asap-project.org/bmla}unheardOf"
    text = write(Block(id="b", unknown_attributes={known: "x", "{urn:a}k": "1", "{urn:b}k": "2"}))
    assert 'bmla:unheardOf="x" ns2:k="1" ns3:k="2"' in text
    assert parse(text).unknown_attributes == {known: "x", "{urn:a}k": "1", "{urn:b}k": "2"}


@pytest.mark.parametrize(
    ("node", "said"),
    [
        (Wait(id="w", duration=math.nan), "wanted a finite number, got nan"),
        (Wait(id="w", syncs={"start": SyncRef(offset=math.inf)}), "wanted a finite number, got inf"),
        (Head(id="h", lexeme="\0"), "wanted characters XML can hold, got U+0000"),
        (
            Speech(id="s", text=SpeechText(parts=("a\ud800",))),
            "wanted characters XML can hold, got U+D800",
        ),
        (
            Wait(id="w", descriptions=(Description(priority=1, type="x", content="<a>"),)),
            "description: wanted well-formed content",
        ),
    ],
)
def test_write_refuses_what_xml_cannot_hold(node: Behaviour, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        write(Block(id="b", children=(node,)))


@pytest.mark.parametrize(
    "content", ["<!DOCTYPE a><a/>", '<?xml version="1.0"?>', "&nobody;", "</x><x>", "</x>"]
)
def test_write_keeps_a_description_inside_its_element(content: str) -> None:
    node = Wait(id="w", descriptions=(Description(priority=1, type="x", content=content),))
    with pytest.raises(ValueError, match="wanted well-formed content"):
        write(Block(id="b", children=(node,)))


@pytest.mark.parametrize(
    "other", ["<a/>", "<a xmlns='urn:a'/>x", "<a xmlns='urn:a'", "", "<a xmlns='u'/><a xmlns='u'/>"]
)
def test_write_refuses_unknown_children_without_a_namespace(other: str) -> None:
    with pytest.raises(ValueError, match="wanted one well-formed element in a namespace of its own"):
        write(Block(id="b", children=(Wait(id="w", unknown_children=(other,)),)))


@pytest.mark.parametrize("block", [None, "<bml id='b'/>", Wait(id="w")])
def test_write_refuses_what_is_no_block(block: object) -> None:
    with pytest.raises(TypeError, match="block: wanted a Block, got"):
        write(block)  # type: ignore[arg-type]
