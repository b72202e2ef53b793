"""A displacement field in, the same field out without triangles that turn over when it is played."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from realizer.arrays import Bool, Float64, Int32

__all__: list[str] = []

ROUNDS = 60
STILL = 1e-4
SHARE = 0.5  # of the way to the mean of the triangles that turn over, each round


def turned(rest: Float64, now: Float64, triangles: Int32) -> Bool:
    """(m,) which triangles face away from where they faced at rest: turned by more than a right angle."""
    before, after = _ups(rest[triangles]), _ups(now[triangles])
    return np.asarray((before * after).sum(axis=1) < 0)


def untangled(
    field: Float64,
    at: Float64,
    triangles: Int32,
    plays: Sequence[tuple[float, Any]],
    fixed: Collection[int],
) -> Float64:
    """The field, softened around the triangles that it turns over, until it turns none over.

    Args:
        field: (n, 3) metres for each metre that is asked; at: (n, 3) metres; triangles: (m, 3).
        plays: metres (signed) up to which the field is played, each with what moves along then, (n, 3).
        fixed: vertices that keep their move.
    """
    out = field.copy()
    free = np.ones(len(at), bool)
    free[list(fixed)] = False
    for _ in range(ROUNDS):
        bad = np.zeros(len(triangles), bool)
        for amount, along in plays:
            moves = amount * out + along
            bad |= turned(at, at + moves, triangles) | turned(at, at + moves / 2, triangles)
        if not bad.any():
            break
        # A triangle that moves as one cannot turn over.
        corners = triangles[bad]
        count = np.bincount(corners.ravel(), minlength=len(at))
        whole = np.repeat(out[corners].mean(axis=1), 3, axis=0)
        pulled = np.stack([np.bincount(corners.ravel(), whole[:, k], len(at)) for k in range(3)], axis=1)
        loose = (count > 0) & free
        step = SHARE * (pulled[loose] / count[loose, None] - out[loose])
        if np.abs(step).max(initial=0.0) < STILL:
            break  # what is left comes from what moves along
        out[loose] += step
    return out


def _ups(corners: Float64) -> Float64:
    a, b, c = corners.transpose(1, 0, 2)
    return np.asarray(np.cross(b - a, c - a))
