"""Tests of source positions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, read, write
from bml_schema.source import Source, Spot
from tests.strategies import blocks

TEXT = """<?xml version="1.0"?>
<!-- <bml id="no"> -->
<bml id="a">
  <head
     id='n' lexeme = "NOD"
     amount="7"/><head id="m" lexeme="NOD"/>
  <b:required xmlns:b="urn:x">
    <b:head id="o" b:priority="3" lexeme="&quot;"/>
  </b:required>
  <speech id="s"><text><![CDATA[<sync id="no"/>]]> & <sync id="t"/></text></speech>
</bml><bml id="c"><head id="n" lexeme="x>y"/></bml>
"""


def under(source: Source, spot: Spot) -> str:
    return source.line(spot.line)[spot.column - 1 : spot.column - 1 + spot.length]


@pytest.mark.parametrize(
    ("path", "attribute", "line", "value"),
    [
        ("/bml", "id", None, "a"),
        ("/bml/head[1]", "amount", None, "7"),
        ("/bml/head[1]", "lexeme", 4, "NOD"),
        ("/bml/head[1]", "nothing", 4, "head"),
        ("/bml/head[2]", "id", 6, "m"),
        ("/bml/required[1]/head[1]", "{urn:x}priority", 8, "3"),
        ("/bml/required[1]/head[1]", "b:priority", 8, "3"),
        ("/bml/speech[1]/text[1]/sync[1]", "id", 10, "t"),
        ("/bml/head[1]", "lexeme", 11, "x>y"),
        ("/bml/head[9]", "lexeme", 6, 'amount="7"/><head id="m" lexeme="NOD"/>'),
        ("", "", 9, "</b:required>"),
        ("", "", 999, ""),
    ],
)
def test_locate_finds_a_path_and_an_attribute(path, attribute, line, value) -> None:
    source = Source(TEXT)
    spot = source.locate(path, attribute, line=line)
    assert under(source, spot) == value
    assert spot.length == max(1, len(value))


def test_locate_distinguishes_documents_by_id() -> None:
    source = Source('<bml id="a"><wait id="w"/></bml><bml id="b"><wait id="w"/></bml>')
    assert source.locate("/bml/wait[1]", "id", line=1, block="b").column == 55
    assert source.locate("/bml/wait[1]", "id", line=1, block="a").column == 23


def test_locate_marks_a_value_over_several_lines_on_its_first() -> None:
    source = Source('<bml id="b"><gaze id="g" target="one\r\ntwo"/></bml>')
    assert under(source, source.locate("/bml/gaze[1]", "target")) == "one"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_source_decodes_bytes_as_the_parser_does(encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?><bml id="é"/>'
    data = text.replace("utf-8-sig", "utf-8").encode(encoding)
    source = Source(data)
    assert under(source, source.locate("/bml", "id")) == "é"


@given(blocks(foreign=False))
def test_find_has_every_behaviour_of_the_parser(block: Block) -> None:
    text = "<!-- one -->\n" + write(block)
    source = Source(text)
    (parsed,) = read(text)
    assert isinstance(parsed, Block)
    for node in parsed.behaviours:
        place = parsed.places[node.id]
        element = source.find(place.path, line=place.line, block=parsed.id)
        assert element is not None
        assert source.id(element) == node.id
        assert source.line_of(element.offset) == place.line
    assert not source.errors


@given(st.text("<>/='\" abml!-[]?&;:\n", max_size=200))
def test_source_takes_any_text_and_has_every_place_inside(text: str) -> None:
    source = Source(text)
    for element in source.elements:
        for spot in (source.name_spot(element), *(source.locate_in(element, a) for a in element.attributes)):
            assert 1 <= spot.line <= text.count("\n") + 1
            assert spot.column - 1 <= len(source.line(spot.line))
    for line in range(1, text.count("\n") + 2):
        source.error_on_line(line)
        source.locate("/bml/a[1]", "a", line=line)
