"""Characters and schedules are the same after a round trip through JSON, to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import fields

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import axis
from realizer.animation.channel import Channel, Crossfade, Gain, Layer
from realizer.animation.idle.blinks import BlinkReduction
from realizer.playback.character import BaseShift, Character
from realizer.scheduling.timing import Schedule
from realizer.server.journal.serialization import (
    character_from_json,
    character_to_json,
    schedule_from_json,
    schedule_to_json,
)

NUMBER = st.floats(-1e6, 1e6)
TIMES = st.lists(NUMBER, min_size=1, max_size=5, unique=True).map(sorted)
NAMES = st.text(max_size=8)


@st.composite
def channels(draw: st.DrawFn) -> Channel:
    times = draw(TIMES)
    values = st.lists(NUMBER, min_size=len(times), max_size=len(times)).map(np.array)
    gains = draw(st.lists(st.builds(Gain, NUMBER, NUMBER, NUMBER, st.sampled_from(("smooth", "linear")))))
    return draw(st.sampled_from((Channel, BlinkReduction)))(
        axis()[draw(st.sampled_from(sorted(axis())))],
        np.array(times),
        draw(values),
        curve=draw(st.sampled_from(("smooth", "linear"))),
        layer=draw(st.sampled_from(Layer)),
        keeps_last=draw(st.booleans()),
        gains=tuple(gains),
        until=draw(NUMBER | st.just(math.inf)),
        crossfade=draw(st.none() | st.builds(Crossfade, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)),
        weight=draw(st.none() | values),
        source=draw(NAMES),
    )


SHIFTS = st.builds(
    BaseShift,
    NUMBER,
    NUMBER,
    st.frozensets(st.sampled_from(("head", "eyes", "mouth"))),
    st.lists(channels(), max_size=2).map(tuple),
)
HELD = st.dictionaries(NAMES, channels(), max_size=2)
CHARACTERS = st.builds(Character, st.none() | NAMES, st.lists(SHIFTS, max_size=2), HELD, HELD)


def same(one: object, other: object) -> bool:
    """To the last bit, through everything."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)  # type: ignore[attr-defined]
    if isinstance(one, Channel | BaseShift | Character | Schedule):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        assert isinstance(other, dict)
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and not isinstance(one, Gain | Crossfade):
        assert isinstance(other, list | tuple)
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


@given(CHARACTERS)
def test_character_to_json_round_trip(character: Character) -> None:
    assert same(character_from_json(json.loads(json.dumps(character_to_json(character)))), character)


@given(NAMES, NUMBER, st.dictionaries(NAMES, st.lists(st.tuples(NAMES, NUMBER), max_size=4), max_size=4))
def test_schedule_to_json_round_trip(
    block: str, start: float, behaviours: dict[str, list[tuple[str, float]]]
) -> None:
    points = {name: tuple(point for point, _ in pairs) for name, pairs in behaviours.items()}
    times = {name: np.array([time for _, time in pairs], float) for name, pairs in behaviours.items()}
    schedule = Schedule(block, points, times, start=start)
    assert same(schedule_from_json(json.loads(json.dumps(schedule_to_json(schedule)))), schedule)
