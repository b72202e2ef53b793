"""Emotion profiles from statistics or observations of FAPs (Raouzaiou et al. 2002, 3.3)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer import tables
from realizer.emotions.profile import Profile

MIN_MEAN = 1.0  # FAPU; FAPs with a smaller mean are not part of an expression


def from_statistics(
    name: str, measured: Mapping[int, tuple[float, float]], source: str = "statistics"
) -> Profile:
    """Return the profile with ranges of one standard deviation around the means (eq. 1).

    Ranges of FAPs that move in one direction only are limited to it (eq. 2 and 3).

    Args:
        measured: FAP -> (mean, standard deviation) in FAPU.

    Raises:
        ValueError: a deviation below 0, or not a number.
    """
    ranges = {}
    for fap, (mean, deviation) in measured.items():
        if not deviation >= 0:
            raise ValueError(f"{name}, FAP {fap}: wanted a deviation of 0 or more, got {deviation}")
        row = tables.faps()[fap - 1]
        low, high = mean - deviation, mean + deviation
        if row.least == 0:
            low, high = max(0.0, low), max(0.0, high)
        if row.most == 0:
            low, high = min(0.0, low), min(0.0, high)
        ranges[fap] = low, high
    return Profile(name, source, ranges)


def from_faces(name: str, frames: Any) -> Profile:
    """Return the profile of observed faces that show the same expression.

    Args:
        frames: (n, 68) FAP values of at least 2 faces; column = FAP - 1.

    Raises:
        ValueError: frames of another shape, or values that are not finite.
    """
    values = np.asarray(frames, np.float64)
    if values.ndim != 2 or values.shape[1] != 68 or len(values) < 2:
        raise ValueError(f"{name}: wanted at least two faces (n, 68), got {values.shape}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: wanted finite values, got NaN or infinity")
    means, deviations = values.mean(axis=0), values.std(axis=0, ddof=1)
    chosen = (int(k) + 1 for k in np.flatnonzero(np.abs(means) >= MIN_MEAN))
    measured = {fap: (float(means[fap - 1]), float(deviations[fap - 1])) for fap in chosen if fap >= 3}
    return from_statistics(name, measured, "faces")
