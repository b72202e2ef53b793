"""Coupling of the inner and outer lip contour in FAP rows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Float32, Int32
from realizer.face.model import Fapu
from realizer.tables import faps

# FAP of the inner contour -> the same move of the outer one.
CONTOURS = {4: 51, 5: 52, 6: 53, 7: 54, 8: 55, 9: 56, 10: 57, 11: 58, 12: 59, 13: 60}
AXES = {"up": 1, "down": 1, "left": 0, "right": 0}
# The lip between the contours keeps 0.35 of its width when squeezed, and reaches 1.65 when stretched.
GIVES = 0.65
LEAST = 0.05  # of the mouth's width: where both contours lie at one height they still shear that far


@dataclass(frozen=True, eq=False, slots=True)
class Contours:
    """Which FAPs belong together, and how far apart they may go.

    Attributes:
        inner, outer: (10,) columns of FAP rows.
        apart: (10,) FAPU, the most by which the two values may differ.
    """

    inner: Int32
    outer: Int32
    apart: Float32


def contours_of(points: Mapping[str, Float32], fapu: Fapu) -> Contours:
    """Return the contours of a face: a lip gives way by a share of its own thickness."""
    table = faps()
    most = []
    for inner, outer in CONTOURS.items():
        row, other = table[inner - 1], table[outer - 1]
        axis = AXES[row.direction]
        between = abs(float(points[row.feature_point][axis] - points[other.feature_point][axis]))
        most.append(max(GIVES * between, LEAST * fapu.mw0) / fapu.metres(row.unit))
    inside, outside = np.array(list(CONTOURS), np.int32) - 1, np.array(list(CONTOURS.values()), np.int32) - 1
    return Contours(inside, outside, np.array(most, np.float32))


def couple_lips(contours: Contours, rows: Float32) -> Float32:
    """Return the rows with the movement that one contour drags from the other.

    A lip is one body: where one contour would leave the other by more than the lip gives way, the contour
    with the smaller request follows. A request for one contour alone is reached exactly.

    Args:
        rows: (n, 68) FAPU.

    Returns:
        (n, 68): `rows` itself where nothing is dragged.
    """
    inner, outer = rows[:, contours.inner], rows[:, contours.outer]
    apart = inner - outer
    excess = apart - np.clip(apart, -contours.apart, contours.apart)
    if not excess.any():
        return rows
    strength = np.abs(inner), np.abs(outer)
    share = strength[0] / np.maximum(strength[0] + strength[1], 1e-6)
    out = rows.copy()
    out[:, contours.outer] = outer + excess * share
    out[:, contours.inner] = inner - excess * (1 - share)
    return out
