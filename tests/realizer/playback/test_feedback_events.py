"""Tests of BML feedback of planned blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import parse, parse_feedback
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.feedback_events import (
    Event,
    EventQueue,
    Phase,
    State,
    acknowledgement,
    events,
    prediction,
    progress,
    sync_progress,
)
from realizer.scheduling.timing import UNKNOWN, Schedule

BLOCK = parse('<bml id="b" characterId="Ann"><gazeShift id="g" target="x"/><head id="h" lexeme="NOD"/></bml>')
SCHEDULE = Schedule(
    "b",
    {"g": ("start", "end"), "h": ("start", "stroke", "end")},
    {"g": np.array([0.0, 1.0]), "h": np.array([0.0, 0.5, 1.0])},
    start=10.0,
)


def test_events_are_in_the_order_of_time_then_of_the_document() -> None:
    due = sorted(events(BLOCK, SCHEDULE, 0, 7))
    assert [f"{e.name}:{e.sync}" for e in due] == ["g:start", "h:start", "h:stroke", "g:end", "h:end"]
    assert [e.time for e in due] == [10.0, 10.0, 10.5, 11.0, 11.0]


def test_sync_progress_has_the_time_on_both_clocks() -> None:
    feedback = sync_progress(BLOCK, "h", "stroke", 10.5, 10.0)
    assert (feedback.id, feedback.time, feedback.global_time, feedback.character_id) == (
        "b:h:stroke",
        0.5,
        10.5,
        "Ann",
    )


def test_events_of_an_earlier_block_end_before_a_later_one_starts() -> None:
    due = [Event(11.0, 1, Phase.START), Event(11.0, 0, Phase.END), *events(BLOCK, SCHEDULE, 0, 7)]
    assert [(e.order, e.phase) for e in sorted(due)[-2:]] == [(0, Phase.END), (1, Phase.START)]


def test_feedback_reads_back_as_written() -> None:
    for feedback in (
        acknowledgement(BLOCK, 10.0),
        prediction(BLOCK, SCHEDULE, State.LURKING, SCHEDULE.behaviours),
        progress(BLOCK, "end", 11.0, State.DONE),
    ):
        assert parse_feedback(feedback.to_xml()) == feedback


def test_prediction_has_the_given_sync_points() -> None:
    feedback = prediction(BLOCK, SCHEDULE, State.PENDING, SCHEDULE.behaviours)
    assert (feedback.blocks[0].global_start, feedback.blocks[0].global_end) == (10.0, 11.0)
    assert feedback.blocks[0].status == "PENDING"
    assert {b.id: {p: r.offset for p, r in b.syncs.items()} for b in feedback.behaviours} == {
        "b:g": {"start": 0.0, "end": 1.0},
        "b:h": {"start": 0.0, "stroke": 0.5, "end": 1.0},
    }
    assert prediction(BLOCK, SCHEDULE, State.IN_EXEC).behaviours == ()


def test_prediction_leaves_out_times_that_are_not_known() -> None:
    times = {"g": np.array([0.0, 2 * UNKNOWN]), "h": 2 * UNKNOWN + np.array([0.0, 0.5, 1.0])}
    schedule = replace(SCHEDULE, times=times)
    feedback = prediction(BLOCK, schedule, State.IN_EXEC, schedule.behaviours)
    assert (feedback.blocks[0].global_start, feedback.blocks[0].global_end) == (10.0, None)
    assert [(b.id, list(b.syncs)) for b in feedback.behaviours] == [("b:g", ["start"])]


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
    assert [e.block for e in calendar.due(1000.0)] == [1] * 7 + [0] * 7
    assert calendar.next is None


def test_add_of_a_playing_block_does_not_start_it_again() -> None:
    calendar = EventQueue()
    block = playing(0, 0.0)
    block.change_state(BlockEvent.START)
    block.change_state(BlockEvent.SUBSIDE)
    calendar.add(block, only={("s", "end")})
    assert [(e.phase, e.sync) for e in calendar.due(10.0)] == [(Phase.SYNC, "end"), (Phase.END, "")]
