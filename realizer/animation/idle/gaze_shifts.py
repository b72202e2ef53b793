"""Gaze shifts of documents, found in their channels."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import GazeShift
from realizer.core.array_types import Float64

# AUs that turn eyes or head -> direction on the plane: left and up are positive.
TURNS = {51: 1, 52: -1, 61: 1, 62: -1, 53: 1j, 54: -1j, 63: 1j, 64: -1j}
Turns: TypeAlias = npt.NDArray[np.complex128]  # on the plane
STILL = 0.01  # degrees
SHOWN = 2.0  # s after its begin, in which a shift may matter


def gaze_shifts(channels: Iterable[Channel], start: float, end: float) -> list[GazeShift]:
    """Return the shifts of eyes and head together that begin from shortly before `start` until `end`.

    Args:
        channels: those of a gaze or a gaze shift share their key times.
    """
    turns = dict[int, tuple[Float64, Turns]]()
    for channel in channels:
        if channel.layer in (Layer.GAZE, Layer.BASE) and (most := _degrees().get(channel.target.column)):
            times = channel.times
            if times[0] <= end and times[-1] >= start - SHOWN:
                before = turns.get(id(times))
                turn: Turns = np.multiply(most, channel.values, dtype=np.complex128)
                turns[id(times)] = times, turn if before is None else before[1] + turn
    found = [shift for times, turn in turns.values() for shift in _shifts(times, turn)]
    return sorted(shift for shift in found if start - SHOWN <= shift.at <= end)


def _shifts(times: Float64, turn: Turns) -> list[GazeShift]:
    """Return the shifts of a gaze: from one key where it rests to the next one."""
    moves = np.abs(np.diff(turn)) > STILL
    edges = np.diff(np.concatenate([[0], moves, [0]]).astype(int))
    firsts, lasts = np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()
    return [
        GazeShift(float(times[first]), float(abs(turn[last] - turn[first])))
        for first, last in zip(firsts, lasts, strict=True)
    ]


@cache
def _degrees() -> dict[int, complex]:
    """Return the turn at full intensity, in degrees, of each column that turns eyes or head."""
    return {au(number)[0].column: way * tables.by_number()[number].degrees for number, way in TURNS.items()}
