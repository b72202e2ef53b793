"""Tests of the text of findings."""

from __future__ import annotations

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema.source import Source, Spot
from realizer.checking.finding import Finding, Label
from realizer.cli.diagnostics import render

ROOM = 60  # columns


def finding(*labels: Label, text: str = "amount: wanted 0..1", notes: tuple[str, ...] = ()) -> Finding:
    return Finding("d.bml", "PARSING_FAILURE", "b:n", "/bml/head[1]", text, text, labels, notes)


def rows(source: str, *labels: Label, width: int = ROOM, notes: tuple[str, ...] = ()) -> list[str]:
    return click.unstyle(render(finding(*labels, notes=notes), Source(source), width=width)).split("\n")


def test_render_underlines_the_fault_and_what_it_conflicts_with() -> None:
    text = "<bml>\n<head id='a'/><head id='a'/>\n</bml>"
    shown = rows(text, Label(Spot(2, 25, 1), "again"), Label(Spot(2, 11, 1), "first", primary=False))
    assert shown[2] == "2 | <head id='a'/><head id='a'/>"
    assert shown[3:] == ["  | " + " " * 24 + "^ again", "  | " + " " * 10 + "- first"]


def test_render_leaves_out_the_lines_between_two_labels() -> None:
    shown = rows("a\nb\nc\nd", Label(Spot(1, 1, 1)), Label(Spot(4, 1, 1), primary=False))
    assert shown[1:] == ["  |", "1 | a", "  | ^", "...", "4 | d", "  | -"]


def test_render_wraps_notes_below_the_source() -> None:
    note = "help: " + "word " * 20
    shown = rows("a", Label(Spot(1, 1, 1)), notes=(note,))
    assert shown[-2].startswith("  = help: word")
    assert shown[-1].startswith(" " * 10 + "word")
    assert all(len(row) <= ROOM + 10 for row in shown[1:])


@pytest.mark.parametrize(
    ("line", "column"),
    [("\tx", 4), ("中x", 2), ("e\u0301x", 1), ("\ufeffx", 0), ("\u202ex", 1)],
    ids=["tab", "wide", "combining", "mark", "direction"],
)
def test_render_marks_the_column_that_a_terminal_shows(line: str, column: int) -> None:
    shown = rows(line, Label(Spot(1, line.index("x") + 1, 1)))
    assert shown[3] == "  | " + " " * column + "^"


@given(st.data())
def test_render_marks_what_is_meant_in_a_line_of_any_length(data: st.DataObject) -> None:
    line = data.draw(st.text("abcdefgh <>=", min_size=1, max_size=300))
    start = data.draw(st.integers(0, len(line) - 1))
    length = data.draw(st.integers(1, min(20, len(line) - start)))
    width = data.draw(st.integers(30, 120))
    row, mark = rows(line, Label(Spot(1, start + 1, length)), width=width)[2:]
    first, count = mark.index("^"), mark.count("^")
    assert row.ljust(500)[first : first + count] == line[start : start + length].ljust(count)
    assert max(len(row), len(mark)) <= width


def test_render_shows_labels_that_lie_far_apart_in_rows_of_their_own() -> None:
    line = "a" + "." * 200 + "b"
    shown = rows(line, Label(Spot(1, 1, 1)), Label(Spot(1, len(line), 1), primary=False))[2:]
    for letter, sign in (("a", "^"), ("b", "-")):
        (row,) = (row for row in shown if letter in row)
        assert shown[shown.index(row) + 1].rstrip()[-1] == sign
        assert shown[shown.index(row) + 1].index(sign) == row.index(letter)
