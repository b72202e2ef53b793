"""Tests of anticipated points."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock
from realizer.playback.anticipation import anticipators_of, lead_times
from realizer.playback.block_planner import plan

WAIT = '<bml id="a"><wait id="w" start="0" end="anticipators:clock:beat"/></bml>'


def playing(text: str) -> ActiveBlock:
    """Return a block that plays from 0 s on; unknown points are at 9 s."""
    block = parse(text)
    planned = plan(block, KINDS, PlanningContext(), external_times=lambda ref: 9.0 + ref.offset)
    made = ActiveBlock(planned, KINDS, PlanningContext(), 0, 1, 0.0)
    made.apply_plan(planned, 0.0, 0.0)
    return made


def test_anticipators_are_those_that_behaviours_refer_to() -> None:
    assert anticipators_of(parse(WAIT)) == {"clock"}


@pytest.mark.parametrize(
    ("body", "least"),
    [
        ("", 0.0),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end"/>', 0.04),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end-0.5"/>', 0.54),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" relax="a:w:end"/>', 0.0),
        (
            '<faceLexeme id="f" lexeme="SMILE" start="0" end="n:end"/>'
            '<head id="n" lexeme="NOD" end="a:w:end"/>',
            0.12,
        ),
        (
            '<faceLexeme id="f" lexeme="SMILE" start="0"/><constraint id="c"><synchronize ref="a:w:end">'
            '<sync ref="f:end+0.1"/></synchronize></constraint>',
            0.14,
        ),
    ],
)
def test_lead_times_is_the_least_time_of_what_is_tied_to_a_point(body: str, least: float) -> None:
    group = [playing(WAIT), playing(f'<bml id="b">{body}</bml>')]
    found = lead_times(group, "clock", ("beat", "other"), 4.0)
    assert found["beat"] == pytest.approx(4.0 + least, abs=0.021)
    assert found["other"] == 4.0


def test_lead_times_keeps_the_least_gap_behind_a_point_that_has_passed() -> None:
    group = [
        playing(WAIT),
        playing('<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end"/></bml>'),
    ]
    relax = group[1].schedule.at("f", "relax")
    assert lead_times(group, "clock", ["beat"], relax + 0.01)["beat"] == pytest.approx(relax + 0.04)
    assert lead_times(group, "clock", ["beat"], 9.0)["beat"] == 9.0, "all has passed"
