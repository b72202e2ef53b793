"""Tests of the page about dialects."""

from __future__ import annotations

from bml_schema.dialects.table import table
from tests.dialects import FILE, render


def test_dialects_page_is_current() -> None:
    assert FILE.read_text("utf-8") == render(), "run: python -m tests.dialects"


def test_dialects_page_has_a_line_for_each_row() -> None:
    assert sum(line.startswith(("| `<", "| every")) for line in render().splitlines()) == len(table().rows)
