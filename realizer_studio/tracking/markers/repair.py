"""Repair of tracked markers, and removal of the head's motion (Wojdel 2005, 7.2.1)."""

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.tracking.markers.layout import Layout

# Names of Wojdel's points: the tip of the nose, the ends of the unit, the ends of the vertical line, and
# the level between the upper and the lower part of the face.
NOSE, UNIT, UPRIGHT, LEVEL = "20", ("2", "3"), ("1", "31"), ("14", "15")
COMPLEX = np.array([1, 1j])  # x and y as one number


def repaired(positions: Float64) -> Float64:
    """Return the positions (n, k, 2) of markers with confusions resolved and gaps interpolated.

    The blob of a missing point may have been assigned to a neighbour that is missing itself. If the blob is
    nearer to the interpolated position of the missing point than to that of the neighbour, it is reassigned
    (figures 7.10, 7.11). Points that are missing in all pictures stay NaN.
    """
    found = positions.copy()
    visible = np.isfinite(found[:, :, 0])
    complete = filled(found)
    for k in np.flatnonzero(~visible.all(axis=0) & visible.any(axis=0)):
        for n in np.flatnonzero(~visible[:, k]):
            distances = np.where(visible[n], np.linalg.norm(found[n] - complete[n, k], axis=1), np.inf)
            neighbour = int(distances.argmin())
            if not visible[n, neighbour]:
                continue
            if distances[neighbour] < np.linalg.norm(
                found[n, neighbour] - _between(found[:, neighbour], visible[:, neighbour], int(n))
            ):
                found[n, k], found[n, neighbour] = found[n, neighbour], np.nan
                visible[n, k], visible[n, neighbour] = True, False
    return filled(found)


def filled(positions: Float64) -> Float64:
    """Return positions (n, k, 2) with gaps interpolated, constant at the ends."""
    complete = positions.copy()
    frames = np.arange(len(positions))
    for column in complete.reshape(len(complete), -1).T:
        known = np.isfinite(column)
        if known.any() and not known.all():
            column[:] = np.interp(frames, frames[known], column[known])
    return complete


def normalised(layout: Layout, positions: Float64) -> Float64:
    """Return positions (n, k, 2) without the head's position, size and roll, x to the person's left, y up.

    With the points of Wojdel's figure 7.4, the tip of the nose is put to 0, the unit is the mean of
    |x2 - x3| over all pictures (eq. 7.5, 7.6), the line between points 1 and 31 is upright, and the mean
    height of points 14 and 15 is 0. Other layouts are centred, have the unit of their mean size, and are
    turned as they are at rest (Kabsch 1976).
    """
    if {NOSE, *UNIT, *UPRIGHT, *LEVEL} <= {*layout.names}:
        at = {name: k for k, name in enumerate(layout.names)}
        centred = positions - positions[:, [at[NOSE]]]
        first, second = (centred[:, at[name]] for name in UNIT)
        centred = centred / max(float(np.abs(first[:, 0] - second[:, 0]).mean()), 1e-9)
        line = centred[:, at[UPRIGHT[0]]] - centred[:, at[UPRIGHT[1]]]
        turned = _rotated(centred, np.arctan2(line[:, 0], line[:, 1]))
        turned[:, :, 1] -= turned[:, [at[name] for name in LEVEL], 1].mean(axis=1)[:, None]
        return turned
    known = np.isfinite(positions).all(axis=(0, 2))
    centred = positions - positions[:, known].mean(axis=1, keepdims=True)
    centred = centred / max(float(np.sqrt(np.square(centred[:, known]).sum(axis=2).mean())), 1e-9)
    rest = layout.positions[known] - layout.positions[known].mean(axis=0)
    a, b = centred[:, known] @ COMPLEX, rest @ COMPLEX
    return _rotated(centred, np.angle((np.conj(a) * b).sum(axis=1)))


def _rotated(positions: Float64, angles: Float64) -> Float64:
    """Return positions (n, k, 2) rotated counterclockwise by angles (n,)."""
    turned = (positions @ COMPLEX) * np.exp(1j * angles)[:, None]
    return np.stack([turned.real, turned.imag], axis=-1)


def _between(trajectory: Float64, visible: Bool, n: int) -> Float64:
    """Return the position of a point (n, 2) in picture `n`, interpolated from other pictures."""
    known = np.flatnonzero(visible)
    known = known[known != n]
    if not len(known):
        return np.full(2, np.inf)
    return np.array([np.interp(n, known, trajectory[known, axis]) for axis in range(2)])
