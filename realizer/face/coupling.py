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


FAR = 1e6  # FAPU between FAPs that do not depend on each other
# Two FAPs of neighbouring points, and FAPU by which the first may go above and below the second: the most
# that action units, visemes and emotions ask for. The other side is alike. 37 and 38 go together.
NEIGHBOURS = (
    *((31, 33, 180, 250), (31, 32, 250, 250), (33, 31, 180, 250), (33, 35, 100, 250), (35, 33, 160, 160)),
    *((4, 8, 230, 250), (8, 4, 285, 200), (8, 12, FAR, 400), (37, 38, 260, 260)),
    *((5, 10, 200, 265), (10, 5, 275, 200), (10, 12, 310, FAR)),
    *((51, 55, 190, 260), (55, 51, 320, 235), (55, 59, FAR, 450)),
    *((52, 57, 370, 265), (57, 52, 345, 260), (57, 59, 400, FAR)),
)


@cache
def _limits() -> tuple[Int32, Float32, Float32]:
    """Return columns (k,), -1 for FAPs that go down or left, and limits (2, k, k), the first FAP last."""
    table = faps()
    pairs = {pair[:2]: pair[2:] for pair in NEIGHBOURS}
    pairs |= {(table[a - 1].mirror, table[b - 1].mirror): most for (a, b), most in pairs.items()}
    columns = np.unique(np.array(list(pairs), np.int32)) - 1
    most = np.full((2, len(columns), len(columns)), FAR, np.float32)
    most[:, range(len(columns)), range(len(columns))] = 0
    for pair, values in pairs.items():
        one, other = np.searchsorted(columns, np.array(pair) - 1)
        most[:, other, one] = values
    for middle in range(len(columns)):
        most = np.minimum(most, most[:, :, middle, None] + most[:, middle, None])
    ways = [-1 if table[column].direction in ("down", "left") else 1 for column in columns]
    return columns, np.array(ways, np.float32), most


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
