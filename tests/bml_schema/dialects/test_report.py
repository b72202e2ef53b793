"""Tests of the report about a translation."""

from __future__ import annotations

from bml_schema import parse
from bml_schema.dialects.report import Report
from bml_schema.dialects.table import table


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
        "without <head velocity>, <saccade mode>"
    )
