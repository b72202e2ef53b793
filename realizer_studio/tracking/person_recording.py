"""A recording of a person in a film: measurements, with gaps filled, smoothed, at an even rate."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.tracking.follower import Person
from realizer_studio.tracking.regressor import Components, Measured, components, measure

LONGEST_GAP = 0.5  # s; the longest gap that is interpolated
SMOOTHING = 0.045  # s, standard deviation of the Gaussian window
QUIET = 0.15  # share of the pictures, those with the least expression, from which rest is estimated
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Recording:
    """The measurements of a person at an even rate."""

    fps: float  # frames a second
    times: Float64  # (n,) seconds
    units: Float64  # (n, len(MEASURED_UNITS)) 0..1; 0 where the person is not seen
    faps: Float64  # (n, 68) FAPU; 0 where the person is not seen
    visible: Bool  # (n,) whether the person is seen, or was lost for a short time only


def record(person: Person, times: Sequence[float], fps: float, neutral: Person | None = None) -> Recording:
    """Return the recording of a person.

    Args:
        times: seconds of all pictures, ascending.
        neutral: the same person at rest; None to estimate rest from the film. A single picture is measured
            without it.
    """
    face_components = components(person.faces)
    if neutral is not None:
        measured = measure(face_components, components(neutral.faces).values.mean(axis=0))
    else:
        measured = (
            measure(face_components, _at_rest(face_components))
            if len(person.faces) > 1
            else measure(face_components)
        )
    return _resampled(measured, np.asarray(times), np.asarray(person.frames), fps)


def rate_of(times: Sequence[float] | Float64) -> float:
    """Return the frames per second of pictures at some times, by the median step, which ignores gaps.

    It is 25 for fewer than two different times.
    """
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return round(1 / step, 3) if step > 0 else 25.0


def _at_rest(face_components: Components) -> Float64:
    """Return the components of the person at rest, the mean of the pictures with the least expression."""
    count = max(1, math.ceil(QUIET * len(face_components.values)))
    measured = measure(face_components)
    for _ in range(ROUNDS):
        calmest = np.argsort(measured.units.sum(axis=1), kind="stable")[:count]
        neutral: Float64 = face_components.values[calmest].mean(axis=0)
        measured = measure(face_components, neutral)
    return neutral


def _resampled(measured: Measured, times: Float64, frames: Any, fps: float) -> Recording:
    """Return measurements of some pictures at an even rate, smoothed, with short gaps filled."""
    measured_times = times[frames]
    even_times = np.arange(math.floor(times[-1] * fps + 1e-6) + 1) / fps
    after = np.clip(np.searchsorted(measured_times, even_times), 0, len(measured_times) - 1)
    before = np.maximum(after - 1, 0)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1 / fps
    distance = np.minimum(
        np.abs(measured_times[after] - even_times), np.abs(even_times - measured_times[before])
    )
    between = (measured_times[before] <= even_times) & (even_times <= measured_times[after])
    visible: Bool = (distance <= step / 2 + 1e-6) | (
        between & (measured_times[after] - measured_times[before] <= LONGEST_GAP)
    )
    # A window over the measured pictures fills gaps at any rate of the film.
    width = max(SMOOTHING, step / 2) if len(measured_times) > 1 else 1.0
    columns = np.concatenate([measured.units, measured.faps], axis=1)
    values = np.zeros((len(even_times), columns.shape[1]))
    for k in np.flatnonzero(visible):
        first, last = np.searchsorted(
            measured_times, (even_times[k] - LONGEST_GAP, even_times[k] + LONGEST_GAP + 1e-9)
        )
        weights = np.exp(-0.5 * ((measured_times[first:last] - even_times[k]) / width) ** 2) + 1e-12
        values[k] = weights @ columns[first:last] / weights.sum()
    units, faps = np.split(values, [measured.units.shape[1]], axis=1)
    return Recording(fps, even_times, units, faps, visible)
