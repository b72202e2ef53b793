"""What a person does in a film: measured, filled and smoothed, at an even rate."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.tracking.follower import Person
from realizer_studio.tracking.regressor import Components, Measured, components, measure

LONGEST_GAP = 0.5  # s that a face may be lost and is guessed between
SMOOTHING = 0.045  # s, standard deviation of the Gaussian window
QUIET = 0.15  # share of the pictures, those with the least expression, that show the person at rest
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Recording:
    """One person at an even rate."""

    fps: float  # frames a second
    times: Float64  # (n,) seconds
    units: Float64  # (n, len(SEEN_UNITS)) 0..1; 0 where the person is not seen
    faps: Float64  # (n, 68) FAPU; 0 where the person is not seen
    seen: Bool  # (n,) whether the person is seen, or was lost for a short time only


def record(person: Person, times: Sequence[float], fps: float, neutral: Person | None = None) -> Recording:
    """Return what a person does.

    Args:
        times: seconds of all pictures, rising.
        neutral: the same person at rest; None looks for rest in the film itself. One picture alone is
            measured against people in general.
    """
    seen = components(person.faces)
    if neutral is not None:
        measured = measure(seen, components(neutral.faces).values.mean(axis=0))
    else:
        measured = measure(seen, _at_rest(seen)) if len(person.faces) > 1 else measure(seen)
    return _evenly(measured, np.asarray(times), np.asarray(person.frames), fps)


def rate_of(times: Sequence[float]) -> float:
    """Return frames a second of pictures at these times: the median, as lost frames make gaps."""
    steps = np.diff(times)
    return round(float(1 / np.median(steps)), 3) if len(steps) else 25.0


def _at_rest(seen: Components) -> Float64:
    """Return the components of the person at rest: the mean of the pictures with the least expression."""
    count = max(1, math.ceil(QUIET * len(seen.values)))
    measured = measure(seen)
    for _ in range(ROUNDS):
        quiet = np.argsort(measured.units.sum(axis=1), kind="stable")[:count]
        neutral: Float64 = seen.values[quiet].mean(axis=0)
        measured = measure(seen, neutral)
    return neutral


def _evenly(measured: Measured, times: Float64, frames: Any, fps: float) -> Recording:
    """Return what was measured in some pictures at an even rate, smooth, with short gaps filled."""
    there = times[frames]
    even = np.arange(math.floor(times[-1] * fps + 1e-6) + 1) / fps
    after = np.clip(np.searchsorted(there, even), 0, len(there) - 1)
    before = np.maximum(after - 1, 0)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1 / fps
    apart = np.minimum(np.abs(there[after] - even), np.abs(even - there[before]))
    between = (there[before] <= even) & (even <= there[after])
    seen: Bool = (apart <= step / 2 + 1e-6) | (between & (there[after] - there[before] <= LONGEST_GAP))
    # A window over the pictures that were measured: it fills gaps, whatever the rate of the film is.
    width = max(SMOOTHING, step / 2) if len(there) > 1 else 1.0
    columns = np.concatenate([measured.units, measured.faps], axis=1)
    values = np.zeros((len(even), columns.shape[1]))
    for k in np.flatnonzero(seen):
        first, last = np.searchsorted(there, (even[k] - LONGEST_GAP, even[k] + LONGEST_GAP + 1e-9))
        weights = np.exp(-0.5 * ((there[first:last] - even[k]) / width) ** 2) + 1e-12
        values[k] = weights @ columns[first:last] / weights.sum()
    units, faps = np.split(values, [measured.units.shape[1]], axis=1)
    return Recording(fps, even, units, faps, seen)
