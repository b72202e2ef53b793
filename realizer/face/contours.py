"""Coupling of the inner and outer lip contour in FAP rows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Float32, Int32
from realizer.face.model import Fapu
from realizer.tables import faps

# FAP of the inner contour -> FAP of the same movement of the outer contour.
CONTOURS = {4: 51, 5: 52, 6: 53, 7: 54, 8: 55, 9: 56, 10: 57, 11: 58, 12: 59, 13: 60}
AXES = {"up": 1, "down": 1, "left": 0, "right": 0}
# Largest change of the distance between the contours, as a part of this distance.
ELASTICITY = 0.65
# Least value of this change, as a part of the mouth's width.
MIN_CHANGE = 0.05


@dataclass(frozen=True, eq=False, slots=True)
class Contours:
    """Pairs of FAPs of the inner and the outer contour, and their limits.

    Attributes:
        inner, outer: (10,) columns of FAP rows.
        max_difference: (10,) FAPU, largest difference of the two values.
    """

    inner: Int32
    outer: Int32
    max_difference: Float32


def contours_of(points: Mapping[str, Float32], fapu: Fapu) -> Contours:
    """Return the contours of a face."""
    table = faps()
    limits = []
    for inner, outer in CONTOURS.items():
        row, other = table[inner - 1], table[outer - 1]
        axis = AXES[row.direction]
        distance = abs(float(points[row.feature_point][axis] - points[other.feature_point][axis]))
        limits.append(max(ELASTICITY * distance, MIN_CHANGE * fapu.mw0) / fapu.metres(row.unit))
    inner_columns, outer_columns = (np.array(list(c), np.int32) - 1 for c in (CONTOURS, CONTOURS.values()))
    return Contours(inner_columns, outer_columns, np.array(limits, np.float32))


def couple_lips(contours: Contours, rows: Float32) -> Float32:
    """Return the rows in which each contour follows the other if it moves too far from it.

    If the values of both contours differ by more than their limit, they approach each other, the smaller one
    more than the larger one. If only one contour has a value, it keeps this value, and the other one follows.

    Args:
        rows: (n, 68) FAPU.

    Returns:
        (n, 68); `rows` itself if no contour has to follow.
    """
    inner, outer = rows[:, contours.inner], rows[:, contours.outer]
    difference = inner - outer
    excess = difference - np.clip(difference, -contours.max_difference, contours.max_difference)
    if not excess.any():
        return rows
    strength = np.abs(inner), np.abs(outer)
    share = strength[0] / np.maximum(strength[0] + strength[1], 1e-6)
    out = rows.copy()
    out[:, contours.outer] = outer + excess * share
    out[:, contours.inner] = inner - excess * (1 - share)
    return out
