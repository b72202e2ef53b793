"""Tests of the table of dialects."""

import re

import pytest

from bml_schema import parse
from bml_schema.dialects.table import MISSING, Report, Row, squeezed, table
from bml_schema.dialects.values import FUNCTIONS
from bml_schema.node_schema import local, schema_of
from bml_schema.vocabulary import VOCABULARY

ROWS = table().rows
CLASSES = {local(tag): cls for tag, cls in VOCABULARY.items()}
# Elements that are children of behaviours, or around documents.
OTHERS = {"sync", "text", "description", "bml"}


def test_table_has_each_row_once() -> None:
    keys = [row[1:4] for row in ROWS]
    assert sorted(keys) == sorted(set(keys))
    assert {row.dialect for row in ROWS} == {"SmartBody", "Greta", "draft", "any"}


def test_table_row_becomes_something_known() -> None:
    for row in ROWS:
        tag, _, becomes = row.becomes.rpartition(": ")
        element = tag.rpartition(":")[2] or row.element.rpartition(":")[2]
        if not row.attribute:
            target = (tag or becomes).rpartition(":")[2]
            assert target in {"", "-", "{value}", "sync", *CLASSES}
            continue
        if becomes.startswith("@"):
            assert becomes[1:] in FUNCTIONS
            assert row.says, "functions are described in words"
        elif "|" in becomes:
            points = {point for cls in CLASSES.values() for point in cls.sync_points}
            assert set(becomes.split("|")) <= points
        elif becomes not in ("", "-", "!"):
            names = [part.partition("=")[0] for part in becomes.split(";")]
            renamed = {r.element: r.becomes.rpartition(": ")[0] or r.becomes for r in ROWS if not r.attribute}
            element = renamed.get(element, element).rpartition(":")[2] or element
            known = CLASSES.get(element)
            if element not in OTHERS:
                assert known is not None
                assert set(names) <= {*schema_of(known).attributes, *known.sync_points}


def test_table_leaves_bml_1_0_as_it_is() -> None:
    for row in (r for r in ROWS if r.attribute and r.element in CLASSES):
        known = schema_of(CLASSES[row.element]).attributes.get(row.attribute)
        if known is None or row.value == MISSING:
            continue
        assert row.value or row.dialect == "any", (
            "a whole attribute of BML 1.0 has another meaning in no dialect"
        )
        words = known.value.words or (
            "NOD",
            "SHAKE",
            "TILT",
            "TILT_LEFT",
            "SMILE",
            "JOY",
            "RAISE_BROWS",
            "SURPRISE",
        )
        if row.value not in ("", "*:*"):
            assert not [word for word in words if row.fits(word)]


@pytest.mark.parametrize(("value", "is_one"), [("TOSS", True), ("toss_up", True), ("stoss", False)])
def test_row_fits_values_by_its_pattern_in_any_case(value: str, is_one: bool) -> None:
    assert Row("Greta", "head", "lexeme", "Toss*", "", "").fits(value) is is_one


def test_row_without_a_value_fits_any() -> None:
    assert Row("Greta", "head", "side", "", "", "").fits("left")


@pytest.mark.parametrize("point", ["stroke_start", "stroke-start", "strokestart", "strokeStart"])
def test_squeezed_points_are_alike_however_they_are_spelled(point: str) -> None:
    assert table().points[squeezed(point)].becomes.startswith("strokeStart|")


def test_table_names_rows_for_messages() -> None:
    names = [row.name for row in ROWS]
    assert "<head repeats>" in names
    assert '<head type="NOD">' in names
    assert all(re.fullmatch(r"<[^<>]+>", name) for name in names)


def test_report_is_false_if_nothing_was_translated() -> None:
    assert not Report(wrapper="act")
    assert Report(made=["the block as x"])


def test_report_names_the_dialect_of_the_wrapper_or_of_most_rows() -> None:
    rows = {row.dialect: row for row in table().rows}
    assert Report([rows["Greta"]]).dialect == "Greta's BML"
    assert Report([rows["Greta"], rows["draft"], rows["any"]], wrapper="act").dialect == "SmartBody's BML"
    assert Report([rows["draft"], rows["any"]]).dialect == "a draft of BML"


def test_report_lists_at_most_twelve_words() -> None:
    assert Report(made=[f"x{n}" for n in range(15)]).text.endswith(", x11 and 3 more")


def test_report_says_what_was_read_how() -> None:
    text = '<bml id="b"><head id="h" type="NOD" repeats="2" velocity="1"/><saccade id="s" mode="talk"/></bml>'
    (problem,) = parse(text).problems
    assert (problem.id, problem.type, problem.line, problem.path) == ("b", "NOT_BML_1_0", 1, "/bml")
    assert problem.text == (
        'read as SmartBody\'s BML: <head type="NOD"> as lexeme=NOD, '
        "<head repeats> as repetition: rounded and at least 1, "
        "<saccade mode> as realizer:idle the eyes of a listener or thinker or idle ones, "
        "without <head velocity>"
    )
