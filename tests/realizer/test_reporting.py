"""Feedback made of a schedule: everything once, in the order of report."""

from __future__ import annotations

import numpy as np

from bml_schema import parse, parse_feedback
from realizer.reporting import acknowledgement, events, prediction, progress
from realizer.scheduling.timing import Schedule

BLOCK = parse('<bml id="b" characterId="Ann"><gazeShift id="g" target="x"/><head id="h" lexeme="NOD"/></bml>')
SCHEDULE = Schedule(
    "b",
    {"g": ("start", "end"), "h": ("start", "stroke", "end")},
    {"g": np.array([0.0, 1.0]), "h": np.array([0.0, 0.5, 1.0])},
    start=10.0,
)


def test_events_are_start_sync_points_and_end_in_order() -> None:
    told = [e.feedback.id for e in sorted(events(BLOCK, SCHEDULE, 0))]
    assert told == ["b:start", "b:g:start", "b:h:start", "b:h:stroke", "b:g:end", "b:h:end", "b:end"]


def test_times_are_on_the_session_clock_and_from_block_start() -> None:
    stroke = next(e.feedback for e in events(BLOCK, SCHEDULE, 0) if e.feedback.id == "b:h:stroke")
    assert (stroke.time, stroke.global_time, stroke.character_id) == (0.5, 10.5, "Ann")


def test_at_one_instant_the_earlier_block_reports_first() -> None:
    first = events(BLOCK, SCHEDULE, 0)
    second = events(parse('<bml id="c"/>'), Schedule("c", {}, {}, start=11.0), 1)
    told = [e.feedback.id for e in sorted([*second, *first])]
    assert told[-3:] == ["b:end", "c:start", "c:end"]


def test_predictions_read_back_as_they_were_written() -> None:
    for told in (
        acknowledgement(BLOCK, 10.0),
        prediction(BLOCK, SCHEDULE),
        progress(BLOCK, "end", 11.0, "DONE"),
    ):
        assert parse_feedback(told.to_xml()) == told


def test_a_prediction_names_every_sync_point() -> None:
    told = prediction(BLOCK, SCHEDULE)
    assert (told.blocks[0].global_start, told.blocks[0].global_end) == (10.0, 11.0)
    assert {b.id: {p: r.offset for p, r in b.syncs.items()} for b in told.behaviours} == {
        "b:g": {"start": 0.0, "end": 1.0},
        "b:h": {"start": 0.0, "stroke": 0.5, "end": 1.0},
    }
