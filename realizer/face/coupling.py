"""FAPs whose points follow one another: the contours of the lips, and neighbours of lips and brows."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

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
    """Pairs of FAPs of the inner and the outer contour, and their limits."""

    inner: Int32  # (10,) columns of FAP rows
    outer: Int32  # (10,) columns of FAP rows
    max_difference: Float32  # (10,) FAPU, largest difference of the two values


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


# FAP -> FAPU by which its value may be above and below those of its neighbours, and these: the most that
# action units, visemes and emotions ask for. 37 and 38 go towards each other.
NEIGHBOURS = {
    **{31: (250, 250, 33, 32), 33: (180, 250, 31, 35), 35: (160, 160, 33), 37: (260, 260, 38)},
    **{32: (250, 250, 34, 31), 34: (180, 250, 32, 36), 36: (160, 160, 34), 38: (260, 260, 37)},
    **{4: (250, 230, 8, 9), 8: (200, 285, 4), 9: (200, 285, 4)},
    **{5: (200, 265, 10, 11), 10: (275, 200, 5), 11: (275, 200, 5)},
    **{51: (260, 190, 55, 56), 55: (235, 320, 51), 56: (235, 320, 51)},
    **{52: (370, 265, 57, 58), 57: (345, 260, 52), 58: (345, 260, 52)},
}
OPPOSITE = 38
FAR = 1e6  # FAPU between FAPs that do not depend on each other


@cache
def _limits() -> tuple[Int32, Float32, Float32]:
    """Return columns (k,), 1 or -1 for each, and the limits above and below (2, k, k), the leader last."""
    numbers = sorted(NEIGHBOURS)
    most = np.full((2, len(numbers), len(numbers)), FAR, np.float32)
    most[:, range(len(numbers)), range(len(numbers))] = 0
    for number, (above, below, *others) in NEIGHBOURS.items():
        most[:, [numbers.index(other) for other in others], numbers.index(number)] = [[above], [below]]
    for middle in range(len(numbers)):
        most = np.minimum(most, most[:, :, middle, None] + most[:, middle, None])
    columns = np.array(numbers, np.int32) - 1
    return columns, np.where(columns == OPPOSITE - 1, -1, 1).astype(np.float32), most


def join_neighbours(rows: Float32) -> Float32:
    """Return rows (n, 68) FAPU in which points follow a neighbour that moves much farther than they do.

    Values that differ by more than in `NEIGHBOURS` approach each other, the smaller one more than the larger.
    A FAP that alone has a value keeps it.
    """
    columns, ways, most = _limits()
    values = rows[:, columns] * ways
    above = values[:, None] - values[:, :, None]  # of the last over the one before
    up, down = np.maximum(above - most[0], 0), np.maximum(-above - most[1], 0)
    if not (up.any() or down.any()):
        return rows
    size = np.abs(values)
    share = size[:, None] / np.maximum(size[:, None] + size[:, :, None], 1e-6)
    out = rows.copy()
    out[:, columns] = (values + (up * share).max(axis=2) - (down * share).max(axis=2)) * ways
    return out
