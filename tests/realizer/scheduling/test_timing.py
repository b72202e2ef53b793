"""Tests of timings, warnings and schedules."""

import math
from dataclasses import replace

import numpy as np
import pytest

from realizer.scheduling.timing import SOFTER, UNKNOWN, Clause, Schedule, Timing, Warning

POINTS = ("start", "relax", "end")


def timing(rigid: bool = False, most: list[float] | None = None, least: float = 0.5) -> Timing:
    bounds = None if most is None else np.array(most)
    return Timing(POINTS, np.array([1.0, 2.0]), np.full(2, least), np.array([4.0, 2.0]), rigid, bounds)


def schedule() -> Schedule:
    warnings = (
        Warning("b1:gone", "IMPOSSIBLE_TO_SCHEDULE", "it was dropped"),
        Warning("b1:a", "NO_SUCH_TARGET", "it plays"),
        Warning("b1:bad", "PARSING_FAILURE", "it was dropped"),
        Warning("other", "IMPOSSIBLE_TO_SCHEDULE", "a constraint"),
    )
    times = {"a": np.array([0.5, 1.0, 3.0]), "w": np.array([0.0, 1.5])}
    return Schedule("b1", {"a": POINTS, "w": ("start", "end")}, times, start=10.0, warnings=warnings)


def test_with_hold_makes_the_softest_gap_softer() -> None:
    assert timing().with_hold.stiffness.tolist() == [4.0, 2.0 * SOFTER]
    assert timing(rigid=True).with_hold.stiffness.tolist() == [4.0, 2.0]


def test_known_has_infinite_times_where_they_are_not_known() -> None:
    whole = schedule()
    assert whole.known is whole
    far = replace(whole, times={"a": np.array([0.5, 1.0, 2 * UNKNOWN]), "w": np.array([0.0, 1.5])})
    assert far.known.behaviours["a"] == {"start": 0.5, "relax": 1.0, "end": math.inf}
    assert far.known.times["w"].tolist() == [0.0, 1.5]
    assert far.known.end == math.inf


@pytest.mark.parametrize("name", ["preferred", "least", "stiffness", "most"])
def test_timing_wants_a_value_for_each_gap(name: str) -> None:
    values = {"preferred": np.ones(2), "least": np.ones(2), "stiffness": np.ones(2)} | {name: np.ones(3)}
    with pytest.raises(ValueError, match=rf"{name}: wanted shape \(2,\) for 3 points, got \(3,\)"):
        Timing(POINTS, **values)


def test_timing_wants_bounds_with_room() -> None:
    with pytest.raises(ValueError, match="most: wanted at least"):
        timing(most=[0.4, 3.0])


def test_warning_has_a_clash_in_json_only_if_there_is_one() -> None:
    assert Warning("b1", "T", "text").to_json() == {"id": "b1", "type": "T", "text": "text"}
    clause = Clause("b1:a", 2, "a:start = 1")
    assert Warning("b1", "T", "text", (clause,)).to_json()["clash"] == [
        {"id": "b1:a", "line": 2, "text": "a:start = 1"}
    ]


def test_schedule_ends_with_its_last_behaviour() -> None:
    assert (schedule().duration, schedule().end) == (3.0, 13.0)
    assert Schedule("b1", {}, {}).duration == 0.0


def test_schedule_names_dropped_behaviours() -> None:
    assert schedule().dropped == ("b1:gone", "b1:bad")


@pytest.mark.parametrize(("behaviour", "sync"), [("b", "start"), ("a", "stroke")])
def test_schedule_at_refuses_what_is_not_there(behaviour: str, sync: str) -> None:
    assert schedule().at("a", "relax") == schedule()["a"]["relax"] == 1.0
    with pytest.raises(KeyError):
        schedule().at(behaviour, sync)


def test_schedule_json_has_the_times_from_block_start() -> None:
    data = schedule().to_json()
    assert data["behaviours"] == {
        "a": {"start": 0.5, "relax": 1.0, "end": 3.0},
        "w": {"start": 0.0, "end": 1.5},
    }
    assert (data["block"], data["start"], data["end"], len(data["warnings"])) == ("b1", 10.0, 13.0, 4)


def test_schedule_does_not_count_dropped_constraints_as_behaviours() -> None:
    gone = Warning("b:c", "IMPOSSIBLE_TO_SCHEDULE", "constraint c cannot be kept", constraint=True)
    assert Schedule("b", {}, {}, warnings=(gone,)).dropped == ()
