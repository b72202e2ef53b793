"""Tests of BML feedback of planned blocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import parse, parse_feedback
from realizer.playback.feedback_events import (
    Event,
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
