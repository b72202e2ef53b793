"""Gaze shifts of documents, found in their channels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import GazeShift

# AUs that turn eyes or head -> direction on the plane: left and up are positive.
TURNS = {51: 1, 52: -1, 61: 1, 62: -1, 53: 1j, 54: -1j, 63: 1j, 64: -1j}
STILL = 0.01  # degrees
SHOWN = 2.0  # s after its begin, in which a shift may matter


def gaze_shifts(channels: Iterable[Channel], start: float, end: float) -> list[GazeShift]:
    """Return the shifts of eyes and head together that begin from shortly before `start` until `end`.

    Args:
        channels: those of a gaze or a gaze shift share their key times.
    """
    turns = dict[int, tuple[list[float], list[complex]]]()
    for channel in channels:
        if channel.layer in (Layer.GAZE, Layer.BASE) and (most := _degrees().get(channel.target.column)):
            keys = channel.times
            if keys[-1] >= start - SHOWN:
                times, turn = turns.get(id(keys)) or (keys.tolist(), [0j] * len(keys))
                values = zip(turn, channel.values.tolist(), strict=True)
                turns[id(keys)] = times, [before + most * value for before, value in values]
    found = [shift for times, turn in turns.values() for shift in _shifts(times, turn)]
    return sorted(shift for shift in found if start - SHOWN <= shift.at <= end)


def _shifts(times: list[float], turn: list[complex]) -> Iterator[GazeShift]:
    """Yield the shifts of a gaze: from a key where it rests to the next one."""
    rest = 0
    for k in range(1, len(times)):
        moves = abs(turn[k] - turn[k - 1]) > STILL
        if not moves or k == len(times) - 1:
            to = k if moves else k - 1
            if to > rest:
                yield GazeShift(times[rest], abs(turn[to] - turn[rest]))
            rest = k


@cache
def _degrees() -> dict[int, complex]:
    """Return the turn at full intensity, in degrees, of each column that turns eyes or head."""
    return {au(number)[0].column: way * tables.by_number()[number].degrees for number, way in TURNS.items()}
