"""Tests of the planner of blocks beside the active ones."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_planner import Plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.block_timeline import BlockTimeline
from realizer.playback.joint_planner import Arrival

NOD = '<head id="n" lexeme="NOD" start="0" end="1"/>'
GAZE = '<gaze id="g" target="camera" start="0" end="2"/>'


@pytest.fixture
def timeline() -> BlockTimeline:
    return BlockTimeline(KINDS, [])


def planned(timeline: BlockTimeline, text: str, start: float = 0.0, **more) -> tuple[Plan, list[ActiveBlock]]:
    arrival = Arrival(parse(text), 0, timeline.blocks.new_number(), PlanningContext())
    return timeline.planner.plan(arrival, start, start, **more)


def play(timeline: BlockTimeline, text: str) -> ActiveBlock:
    plan, _ = planned(timeline, text)
    number = timeline.blocks.last_number
    made = ActiveBlock(plan, KINDS, PlanningContext(), 0, number, 0.0)
    made.apply_plan(plan, 0.0, 0.0)
    timeline.blocks.add(made)
    return made


def test_plan_moves_linked_blocks_that_can_wait(timeline) -> None:
    first = play(timeline, '<bml id="a"><head id="n" lexeme="NOD" start="2"/></bml>')
    text = '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="3" end="a:n:start+1"/></bml>'
    plan, others = planned(timeline, text)
    assert others == [first]
    (schedule,) = plan.other_schedules
    assert schedule.at("n", "start") + 1 == pytest.approx(plan.schedule.at("f", "end"))
    assert first.schedule.at("n", "start") == 2, "a plan changes nothing"


def test_plan_alone_leaves_other_blocks_as_they_are(timeline) -> None:
    play(timeline, '<bml id="a"><head id="n" lexeme="NOD" start="2"/></bml>')
    plan, others = planned(
        timeline, '<bml id="b"><head id="m" lexeme="NOD" start="a:n:end"/></bml>', alone=True
    )
    assert (others, plan.other_schedules) == ([], [])


def test_plan_gives_way_to_claims_of_playing_blocks_except_ended_ones(timeline) -> None:
    first = play(timeline, f'<bml id="a">{GAZE}</bml>')
    text = f'<bml id="b">{GAZE}</bml>'
    assert planned(timeline, text)[0].schedule.times.keys() == {"g"}, "the first may still move"
    first.change_state(BlockEvent.START)
    assert not planned(timeline, text)[0].schedule.times
    assert planned(timeline, text, ended=[first])[0].schedule.times.keys() == {"g"}


def test_fit_says_why_there_is_none(timeline) -> None:
    first = play(timeline, f'<bml id="a">{NOD}</bml>')
    second = play(
        timeline, '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="a:n:start" end="a:n:end"/></bml>'
    )
    fitted = timeline.planner.fit([first, second], 0.0, 0.0)
    assert [schedule.block for schedule in fitted] == ["a", "b"]
    first.context = PlanningContext(max_planning=1)
    assert "wanted at most 1 steps" in timeline.planner.fit([first, second], 0.0, 0.0)
