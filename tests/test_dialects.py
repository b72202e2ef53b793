"""Tests of the page about dialects, and of a document for each row of their table."""

from __future__ import annotations

import pytest

from bml_schema import Block, read, write
from bml_schema.dialects.intentions import intentions
from bml_schema.dialects.table import Row, table
from realizer.pipeline import plan
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice
from tests.dialects import FILE, ROWS, cases, published, render, sample
from tests.realizer.server.session.test_composition import events, live, offline
from tests.rows import each_row


def test_dialects_page_is_current() -> None:
    assert FILE.read_text("utf-8") == render(), "run: python -m tests.dialects"


def test_dialects_page_has_a_line_for_each_row() -> None:
    lines = [line for line in render().splitlines() if line.startswith(("| `<", "| every"))]
    assert len(lines) == len(table().rows) + len(intentions())


def test_rows_become_what_their_file_says() -> None:
    assert ROWS.read_text("utf-8") == cases(), "run: python -m tests.dialects, and review the changes"


@pytest.mark.long
@pytest.mark.slow
@each_row("row", table().rows)
def test_rows_play_alike_live_and_offline_and_as_bml_1_0(row: Row) -> None:
    voice, document = SilentVoice(), sample(row)
    expected = events(offline([document], voice))
    assert expected
    assert events(live([document], voice)) == expected
    (block,) = read(document)
    assert isinstance(block, Block)
    expected.subtract({("NOT_BML_1_0", "b", 0.0): 1})
    assert events(offline([write(block)], voice)) == +expected


@each_row("dialect, element, attribute, value", published())
def test_published_attribute_costs_no_behaviour_and_one_warning(
    dialect: str, element: str, attribute: str, value: str
) -> None:
    (block,) = read(document := sample(Row(dialect, element, attribute, value, "", "")))
    assert isinstance(block, Block), document
    assert [(p.id, p.type) for p in block.problems] in ([], [("b", "NOT_BML_1_0")]), document
    assert "does nothing" not in str(block.problems), document
    (schedule,) = plan([document], Player(animates=False), SilentVoice())[0]
    assert not schedule.dropped, document
