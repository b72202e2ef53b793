"""Tests of the first pass over a <bml> element."""

from lxml import etree

from bml_schema import VOCABULARY, Head, Speech
from bml_schema.reading.block_outline import BlockOutline, flat
from bml_schema.reading.element_reader import ElementReader
from bml_schema.sync_refs import Names


def outline(inside: str) -> tuple[BlockOutline, list[object]]:
    names = Names("b")
    found = BlockOutline(ElementReader(VOCABULARY, names), names)
    root = etree.fromstring(f"<bml id='b'>{inside}</bml>")
    return found, list(found.entries(root, "/bml", required=False))


def test_entries_of_required_are_a_flat_list() -> None:
    found, tree = outline("<head id='a'/><required><head/><required><wait id=' c '/></required></required>")
    first, inside = tree
    assert isinstance(inside, list)
    summary = [(e.id, e.path, e.required) for e in flat([first, inside])]  # type: ignore[list-item]
    assert summary == [
        ("a", "/bml/head[1]", False),
        ("", "/bml/required[1]/head[1]", True),
        ("c", "/bml/required[1]/required[1]/wait[1]", True),
    ]
    assert set(found.owners) == {"a", "c"}


def test_owners_have_the_first_of_two_with_an_id() -> None:
    found, _ = outline("<head id='a'/><speech id='a'/><constraint id='k'/>")
    assert found.owners["a"].kind.cls is Head
    assert set(found.names.points) == {"a"}


def test_names_have_sync_points_strokes_marks_and_unknown_elements() -> None:
    speak = "<description><speak><mark name='n'/><mark name='no:name'/></speak></description>"
    found, _ = outline(
        f"<speech id='s'><text>a<sync id='m'/></text>{speak}</speech>"
        "<head id='h' repetition='3'/><what id='w'/>"
    )
    speech, head = found.names.points["s"], found.names.points["h"]
    assert speech is not None
    assert set(speech.names) == {*Speech.sync_points, "m", "n"}
    assert head is not None
    assert (head.strokes, "stroke" in head.names) == (3, True)
    assert found.names.points["w"] is None


def test_loose_text_has_its_place() -> None:
    found, _ = outline(" <required> oops <head/></required> ")
    assert [(text, path) for text, _, path in found.loose] == [("oops", "/bml/required[1]")]
