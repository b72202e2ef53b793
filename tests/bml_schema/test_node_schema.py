"""Tests of node classes and their schemas."""

from dataclasses import FrozenInstanceError

import pytest

from bml_schema import (
    VOCABULARY,
    Behaviour,
    Block,
    Part,
    SyncRef,
    attribute,
    child,
    children,
    node,
    number,
    one_of,
    parse,
    sync_ref,
    text,
    word,
    write,
)
from bml_schema.node_schema import camel, local, schema_of

OURS = "urn:bml-realizer:test"


@node
class Wink(Behaviour):
    tag = f"{{{OURS}}}wink"
    sync_points = ("start", "attackPeak", "relax", "end")
    side: str = attribute(one_of("LEFT", "RIGHT"))
    how_much: float = attribute(number(0, 1), default=1.0)


@node
class Trajectory(Part):
    tag = f"{{{OURS}}}trajectory"
    to: float = attribute(number(0, 9), name="targetValue")
    after: SyncRef | None = attribute(sync_ref, default=None)
    points: str = text(default="")


@node
class Note(Part):
    tag = f"{{{OURS}}}note"
    by: str = attribute(word, default="nobody")


@node
class Change(Behaviour):
    tag = f"{{{OURS}}}change"
    trajectory: Trajectory = child(Trajectory)
    notes: tuple[Note, ...] = children(Note)


OPEN = {**VOCABULARY, Wink.tag: Wink, Change.tag: Change}


def document(inside: str) -> str:
    core = "http://www.bml-initiative.org/bml/bml-1.0"
    return f'<bml id="b" xmlns="{core}" xmlns:x="{OURS}">{inside}</bml>'


def test_node_class_is_read_and_written_like_a_core_behaviour() -> None:
    inside = '<x:wink id="w" side="LEFT" attackPeak="1"/><head id="h" lexeme="NOD" start="w:attackPeak+1"/>'
    block = parse(document(inside), OPEN)
    wink = block["w"]
    assert isinstance(wink, Wink)
    assert (wink.side, wink.how_much) == ("LEFT", 1.0)
    assert wink.syncs == {"attackPeak": SyncRef(offset=1.0)}
    assert block["h"].syncs["start"] == SyncRef(behaviour="w", sync="attackPeak", offset=1.0)
    assert parse(write(block), OPEN) == block


def test_node_class_missing_from_the_vocabulary_is_not_supported() -> None:
    block = parse(document('<x:wink id="w" side="LEFT"/>'))
    assert [(p.id, p.type) for p in block.problems] == [("b:w", "CUSTOM_BEHAVIOR_NOT_SUPPORTED")]


def test_node_class_field_has_its_name_in_camel_case() -> None:
    block = parse(document('<x:wink id="w" side="LEFT" howMuch="0.25"/>'), OPEN)
    assert isinstance(block["w"], Wink)
    assert block["w"].how_much == 0.25
    assert camel("offset_angle") == "offsetAngle"


def test_node_class_fault_reads_like_any_other() -> None:
    block = parse(document('\n<x:wink id="w" howMuch="2"/>'), OPEN)
    said = "line 2, /bml/wink[1]: howMuch: wanted 0..1, got 2; side: wanted LEFT or RIGHT, got none"
    assert [str(p) for p in block.problems] == [said]


def test_node_class_reads_children_text_and_references_inside() -> None:
    inside = (
        '<x:change id="c"><x:trajectory targetValue="3" after="c:start+1">0 1 &lt; 2</x:trajectory>'
        '<x:note/><x:note by="me"/></x:change>'
    )
    block = parse(document(inside), OPEN)
    after = SyncRef(behaviour="c", sync="start", offset=1.0)
    assert block["c"] == Change(
        id="c",
        trajectory=Trajectory(to=3.0, after=after, points="0 1 < 2"),
        notes=(Note(), Note(by="me")),
    )
    assert parse(write(block), OPEN) == block


def test_node_class_reads_children_in_the_core_namespace() -> None:
    block = parse(document('<x:change id="c"><trajectory targetValue="3"/></x:change>'), OPEN)
    assert block["c"] == Change(id="c", trajectory=Trajectory(to=3.0), notes=())


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("", "wanted <trajectory> or <note>, got none"),
        ('<x:trajectory targetValue="1"/>' * 2, "wanted one <trajectory>, got 2"),
        ('<x:trajectory targetValue="1"><x:q/></x:trajectory>', "wanted text, got <q>"),
        ("<head/>", "wanted <trajectory> or <note>, got <head>"),
    ],
)
def test_node_class_with_wrong_children_drops_the_behaviour(inside: str, said: str) -> None:
    block = parse(document(f'<x:change id="c">{inside}</x:change>'), OPEN)
    assert not block.behaviours
    assert [p.text for p in block.problems] == [said]


def test_node_is_frozen_and_has_no_dict() -> None:
    wink = Wink(id="w", side="LEFT")
    with pytest.raises(FrozenInstanceError):
        wink.side = "RIGHT"  # type: ignore[misc]
    assert not hasattr(wink, "__dict__")


def test_schema_of_a_class_is_made_once() -> None:
    assert schema_of(Block) is schema_of(Block)
    assert local("{urn:x}a") == local("a") == "a"
