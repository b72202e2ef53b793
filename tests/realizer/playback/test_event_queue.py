"""Tests of the queue of events."""

from __future__ import annotations

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.event_queue import EventQueue
from realizer.playback.feedback_events import Phase

FACE = '<faceLexeme id="s" lexeme="SMILE" start="0" attackPeak="0.5" relax="2" end="3"/>'


def playing(number: int, start: float) -> ActiveBlock:
    planned = plan(parse(f'<bml id="a">{FACE}</bml>'), KINDS, PlanningContext(), start=start)
    made = ActiveBlock(planned, KINDS, PlanningContext(), character=0, number=number, not_before=start)
    made.apply_plan(planned, start, start)
    made.order = number
    return made


def test_due_yields_events_in_order_when_they_are_due() -> None:
    calendar = EventQueue()
    calendar.add(playing(1, 2.0))
    calendar.add(playing(0, 0.0))
    assert calendar.next == 0.0
    due = list(calendar.due(2.0))
    assert [(e.time, e.block) for e in due] == [(0, 0), (0, 0), (0.5, 0), (2, 0), (2, 0), (2, 1), (2, 1)]
    assert [e.phase for e in due[:2]] == [Phase.START, Phase.SYNC]
    assert calendar.next == 2.5


def test_due_yields_events_that_are_added_meanwhile() -> None:
    calendar = EventQueue()
    calendar.add(playing(0, 0.0))
    seen = []
    for event in calendar.due(10.0):
        seen.append((event.time, event.block))
        if len(seen) == 1:
            calendar.add(playing(1, 0.25))
    assert seen == sorted(seen)
    assert (0.25, 1) in seen


def test_drop_removes_the_events_of_one_block_only() -> None:
    calendar = EventQueue()
    first, second = playing(0, 0.0), playing(1, 0.0)
    calendar.add(first)
    calendar.add(second)
    list(calendar.due(1.0))
    assert calendar.pending(first) == {("s", "relax"), ("s", "end")}
    calendar.drop(first)
    assert calendar.pending(first) == set()
    assert {e.block for e in calendar.due(10.0)} == {1}
    assert calendar.next is None


def test_add_of_a_block_again_yields_its_events_once() -> None:
    calendar = EventQueue()
    block = playing(0, 0.0)
    calendar.add(block)
    calendar.drop(block)
    calendar.add(block)
    assert [e.phase for e in calendar.due(10.0)].count(Phase.END) == 1


def test_add_of_a_block_that_moves_often_leaves_nothing_behind() -> None:
    calendar = EventQueue()
    beside = playing(1, 5.0)
    calendar.add(beside)
    for later in range(200):
        block = playing(0, 100.0 - later / 10)
        calendar.drop(block)
        calendar.add(block)
        assert calendar.next == 5.0
    assert len(calendar._firsts) < 50
    assert [e.block for e in calendar.due(1000.0)] == [1] * 7 + [0] * 7
    assert calendar.next is None


def test_add_of_a_playing_block_does_not_start_it_again() -> None:
    calendar = EventQueue()
    block = playing(0, 0.0)
    block.change_state(BlockEvent.START)
    block.change_state(BlockEvent.SUBSIDE)
    calendar.add(block, only={("s", "end")})
    assert [(e.phase, e.sync) for e in calendar.due(10.0)] == [(Phase.SYNC, "end"), (Phase.END, "")]
