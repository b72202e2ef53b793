"""Tests of sync points with names of dialects."""

import pytest
from lxml import etree

from bml_schema import parse
from bml_schema.canonical import MAX_ATTRIBUTES
from bml_schema.dialects.sync_points import SyncPoints
from bml_schema.dialects.table import Row

KINDS = {"f": "faceLexeme", "h": "head"}


@pytest.mark.parametrize(
    ("reference", "in_dialect", "translated"),
    [
        ("f:stroke + 0.5", True, "f:attackPeak + 0.5"),
        ("f:stroke", False, "f:stroke"),
        ("f:attack_peak", False, "f:attackPeak"),
        ("after(h:stroke_end)", True, "h:strokeEnd"),
        ("act:start", True, "bml:start"),
        ("h:start", True, "h:start"),
        ("unknown:stroke_start", True, "unknown:stroke_start"),
        ("1.5", True, "1.5"),
    ],
)
def test_reference_has_the_point_that_the_behaviour_has(
    reference: str, in_dialect: bool, translated: str
) -> None:
    rows: list[Row] = []
    assert SyncPoints(KINDS, rows.append, in_dialect).reference(reference) == translated
    assert bool(rows) == (translated != reference and not reference.startswith("act"))


def test_sync_points_are_translated_in_attributes_and_references() -> None:
    face = '<face id="f" type="facs" au="1" ready="0.4" stroke_end="1"/>'
    block = parse(
        f'<bml id="b">{face}<gaze id="g" target="x" stroke="f:ready + 0.1" end="after(f:stroke_end)"/></bml>'
    )
    assert {p: str(r) for p, r in block["f"].syncs.items()} == {"attackPeak": "0.4", "relax": "1"}
    assert {p: str(r) for p, r in block["g"].syncs.items()} == {
        "ready": "f:attackPeak + 0.1",
        "end": "f:relax",
    }


@pytest.mark.parametrize(
    ("name", "spaces", "is_renamed"), [("head", 0, True), ("head", MAX_ATTRIBUTES, False), ("text", 0, False)]
)
def test_translate_leaves_elements_without_points_and_with_many_attributes(
    name: str, spaces: int, is_renamed: bool
) -> None:
    element = etree.Element(name, {"stroke_end": "1"} | {f"x{k}": "" for k in range(spaces)})
    SyncPoints(KINDS, lambda row: None, in_dialect=True).translate(element)
    assert ("strokeEnd" in element.attrib) == is_renamed
