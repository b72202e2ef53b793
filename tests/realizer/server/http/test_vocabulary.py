"""The vocabulary is that of the parser, the tables and the faces."""

from __future__ import annotations

import json

from bml_schema.node_schema import local
from realizer.behaviours.registry import VOCABULARY
from realizer.server.http.vocabulary import vocabulary
from tests.rows import each_row

ALL = json.loads(vocabulary())
ELEMENTS = {element["name"]: element for element in ALL["elements"]}


@each_row("tag", VOCABULARY)
def test_vocabulary_has_every_behaviour_as_child_of_a_block(tag: str) -> None:
    name = local(tag)
    assert ELEMENTS[name]["namespace"] == tag[1:].partition("}")[0]
    assert ELEMENTS[name]["syncs"] == list(VOCABULARY[tag].sync_points)
    assert ELEMENTS[name]["about"]
    assert name in ELEMENTS["bml"]["children"]
    assert name in ELEMENTS["required"]["children"]


def test_vocabulary_describes_every_child() -> None:
    assert {child for e in ELEMENTS.values() for child in e["children"]} <= ELEMENTS.keys()


def test_vocabulary_marks_required_attributes_and_closed_sets() -> None:
    gaze = {a["name"]: a for a in ELEMENTS["gaze"]["attributes"]}
    assert gaze["target"]["required"]
    assert not gaze["influence"]["required"]
    assert "UPLEFT" in gaze["offsetDirection"]["words"]


def test_vocabulary_lists_words_of_tables_by_element_and_attribute() -> None:
    assert "SMILE" in ALL["values"]["faceLexeme lexeme"]
    assert "NOD" in ALL["values"]["head lexeme"]
    for pair in ALL["values"]:
        element, attribute = pair.split()
        assert attribute in {a["name"] for a in ELEMENTS[element]["attributes"]}, pair


def test_vocabulary_has_rows_for_sliders_and_the_wheel() -> None:
    assert [fap["fap"] for fap in ALL["faps"]] == list(range(3, 69))
    assert {au["au"] for au in ALL["aus"]} >= {1, 2, 4, 12, 45}
    for kind, number in (("aus", "au"), ("faps", "fap")):
        members = [member for group in ALL["groups"][kind] for member in group["members"]]
        assert sorted(members) == sorted(row[number] for row in ALL[kind])
    kinds = [place["kind"] for place in ALL["wheel"]]
    assert kinds.count("basic") == kinds.count("advanced") == 8
    assert "fear 8" in ALL["profiles"]["published"]
    assert any(voice["available"] for voice in ALL["voices"])
