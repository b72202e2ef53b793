"""The influence of a zone by distance from its centre (1) to its edge (0)."""

from __future__ import annotations

from typing import Any

import numpy as np

from realizer.core.array_types import Float64

MIN_POWER = 1e-3  # an ease of -100 is the limit where nothing moves
SAMPLES = 2001


def linear(distance: Any) -> Float64:
    """Return 1 - d."""
    return np.asarray(1 - np.clip(distance, 0, 1), np.float64)


def ease(distance: Any, amount: float) -> Float64:
    """Return 1 - d^p (Paul 2010, 4.3.3): p = 1 + e/100 where e <= 0, 1 + e/20 above.

    Args:
        amount: e, from -100 (less influence) over 0 (linear) to 100 (more).
    """
    power = 1 + amount / (100 if amount <= 0 else 20)
    return np.asarray(1 - np.clip(distance, 0, 1) ** max(power, MIN_POWER), np.float64)


def cosine(distance: Any) -> Float64:
    """Return the raised cosine that Paul 2010 (8.2) names: level in the middle and at the edge."""
    return np.asarray((1 + np.cos(np.pi * np.clip(distance, 0, 1))) / 2, np.float64)


def smooth_curve(distance: Any, centre: float, side: float) -> Float64:
    """Return a Bezier curve (Paul 2010, 4.3.4): level over `centre` of the zone, `side` past its edge.

    The cubic runs from (0, 1) by (centre, 1) and (1, 0) to (1 + side, 0), so that 0 and 0 is the straight
    line, and side makes the zone larger by that share of its size. (His figure draws it; the text gives no
    formula: these control points are ours.)

    Args:
        centre, side: 0..1.
    """
    t = np.linspace(0, 1, SAMPLES)
    one, two, three = 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3
    along = one * centre + two + three * (1 + side)
    height = (1 - t) ** 3 + one
    return np.asarray(np.interp(np.maximum(distance, 0), along, height, right=0.0), np.float64)
