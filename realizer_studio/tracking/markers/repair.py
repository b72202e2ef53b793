"""Repair of tracked markers, and removal of the head's motion (Wojdel 2005, 7.2.1)."""

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.tracking.markers.layout import Layout

# Names of her points: the tip of the nose, the ends of the unit, those of the upright line, and the level
# between the upper and the lower part of the face.
NOSE, UNIT, UPRIGHT, LEVEL = "20", ("2", "3"), ("1", "31"), ("14", "15")
COMPLEX = np.array([1, 1j])  # x and y as one number


def repaired(places: Float64) -> Float64:
    """Return the places (n, k, 2) of markers without NaN: exchanges resolved, gaps interpolated.

    Where a point is missing, its neighbour may have been taken for it, and be the one that is missing. If the
    neighbour's blob is nearer to where the missing point should be than to where the neighbour should be, it
    belongs to the missing point (figures 7.10, 7.11). A point that is never seen stays NaN.
    """
    found = places.copy()
    there = np.isfinite(found[:, :, 0])
    whole = filled(found)
    for k in np.flatnonzero(~there.all(axis=0) & there.any(axis=0)):
        for n in np.flatnonzero(~there[:, k]):
            others = np.where(there[n], np.linalg.norm(found[n] - whole[n, k], axis=1), np.inf)
            other = int(others.argmin())
            if not there[n, other]:
                continue
            if others[other] < np.linalg.norm(
                found[n, other] - _between(found[:, other], there[:, other], int(n))
            ):
                found[n, k], found[n, other] = found[n, other], np.nan
                there[n, k], there[n, other] = True, False
    return filled(found)


def filled(places: Float64) -> Float64:
    """Return places (n, k, 2) with gaps interpolated, and the nearest known ones at the ends."""
    whole = places.copy()
    frames = np.arange(len(places))
    for column in whole.reshape(len(whole), -1).T:
        known = np.isfinite(column)
        if known.any() and not known.all():
            column[:] = np.interp(frames, frames[known], column[known])
    return whole


def normalised(layout: Layout, places: Float64) -> Float64:
    """Return places (n, k, 2) without the head's place, size and roll, x to the person's left, y up.

    With the points of Wojdel's figure 7.4, the tip of the nose is put to 0, the unit is the mean of
    |x2 - x3| over all pictures (eq. 7.5, 7.6), the line between points 1 and 31 is upright, and the mean
    height of points 14 and 15 is 0. Other layouts are centred, have the unit of their mean size, and are
    turned as they are at rest (Kabsch 1976).
    """
    if {NOSE, *UNIT, *UPRIGHT, *LEVEL} <= {*layout.names}:
        at = {name: k for k, name in enumerate(layout.names)}
        centred = places - places[:, [at[NOSE]]]
        first, second = (centred[:, at[name]] for name in UNIT)
        centred = centred / max(float(np.abs(first[:, 0] - second[:, 0]).mean()), 1e-9)
        line = centred[:, at[UPRIGHT[0]]] - centred[:, at[UPRIGHT[1]]]
        turned = _rotated(centred, np.arctan2(line[:, 0], line[:, 1]))
        turned[:, :, 1] -= turned[:, [at[name] for name in LEVEL], 1].mean(axis=1)[:, None]
        return turned
    known = np.isfinite(places).all(axis=(0, 2))
    centred = places - places[:, known].mean(axis=1, keepdims=True)
    centred = centred / max(float(np.sqrt(np.square(centred[:, known]).sum(axis=2).mean())), 1e-9)
    rest = layout.places[known] - layout.places[known].mean(axis=0)
    a, b = centred[:, known] @ COMPLEX, rest @ COMPLEX
    return _rotated(centred, np.angle((np.conj(a) * b).sum(axis=1)))


def _rotated(places: Float64, angles: Float64) -> Float64:
    """Return places (n, k, 2) turned counterclockwise by angles (n,)."""
    turned = (places @ COMPLEX) * np.exp(1j * angles)[:, None]
    return np.stack([turned.real, turned.imag], axis=-1)


def _between(way: Float64, there: Bool, n: int) -> Float64:
    """Return where a point (n, 2) should be in picture `n` after the nearest ones before and after it."""
    known = np.flatnonzero(there)
    known = known[known != n]
    if not len(known):
        return np.full(2, np.inf)
    return np.array([np.interp(n, known, way[known, axis]) for axis in range(2)])
