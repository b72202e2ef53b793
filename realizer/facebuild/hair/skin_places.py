"""Places on the skin that are given in the front view."""

from __future__ import annotations

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import flat_cross


def seen_from_front(at: Float64, triangles: Int32, flat: Float64) -> tuple[Int32, Float64]:
    """Return the corners (n, 3) of the foremost triangle at places (n, 2) in front view, and their shares.

    A place beside all triangles gets the one that it misses by least, and shares that continue it.

    Args:
        at: (m, 3) metres.
    """
    low, high = flat.min(axis=0) - 0.01, flat.max(axis=0) + 0.01
    inside = ((at[:, :2] > low) & (at[:, :2] < high)).all(axis=1) & (at[:, 2] > -0.03)
    mine = triangles[inside[triangles].any(axis=1)]
    a, b, c = (at[mine[:, k], :2] for k in range(3))
    turn = flat_cross(b - a, c - a)
    mine, a, b, c, turn = (part[turn > 1e-9] for part in (mine, a, b, c, turn))
    place = flat[:, None]
    s = flat_cross(place - a, c - a) / turn
    t = flat_cross(b - a, place - a) / turn
    out = np.maximum(np.maximum(-s, -t), np.maximum(s + t - 1, 0))
    best = (out - 0.1 * at[mine, 2].mean(axis=1)).argmin(axis=1)
    row = np.arange(len(flat))
    s, t = s[row, best], t[row, best]
    return mine[best], np.stack([1 - s - t, s, t], axis=1)
