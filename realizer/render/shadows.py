"""The shadows of the key lamp: numba's version of a part of `surface.glsl`."""

import math
from typing import Any

import numpy as np

from realizer.render.compiled import compiled
from realizer.render.lamp_view import ASIDE, NEAR, SIDE, SOFT

AWAY = np.float32(1.5)  # nearness to the lamp is this less depth, so that it is above 0 everywhere


@compiled
def depths_of(keys: Any, rows: Any, depths: Any, ends: Any) -> None:
    """Write the depths of a band of rows, 2 where nothing is, and clear its samples.

    Args:
        keys: (SIDE, SIDE, k) as of `visibility.fill`; depths: (SIDE, SIDE, k).
        ends: (SIDE, SIDE, 2), the nearest and the farthest of a texel.
    """
    for j in range(rows[0], rows[1]):
        for i in range(SIDE):
            near, far = np.float32(2), np.float32(0)
            for k in range(depths.shape[2]):
                key = keys[j, i, k]
                keys[j, i, k] = 0
                depth = AWAY - np.uint32(key >> np.uint64(32)).view(np.float32)
                if key == 0:
                    depth = np.float32(2)
                depths[j, i, k] = depth
                near, far = min(near, depth), max(far, depth)
            ends[j, i, 0], ends[j, i, 1] = near, far


@compiled
def ends_around(ends: Any, rows: Any, out: Any) -> None:
    """Write the nearest and the farthest depth of each texel and those around, in a band of rows.

    Args:
        ends: those of the texels alone; out: (SIDE, SIDE, 2), whose outermost texels stay as they are.
    """
    for j in range(max(rows[0], 1), min(rows[1], SIDE - 1)):
        for i in range(1, SIDE - 1):
            near, far = ends[j, i, 0], ends[j, i, 1]
            for row in range(j - 1, j + 2):
                for column in range(i - 1, i + 2):
                    near, far = min(near, ends[row, column, 0]), max(far, ends[row, column, 1])
            out[j, i, 0], out[j, i, 1] = near, far


@compiled
def reach(shadows: Any, place: Any, normal: Any) -> Any:
    """Return the share of the lamp that a place with that normal sees.

    Args:
        shadows: depths (SIDE, SIDE, k) of the samples of each texel; ends around it, as `ends_around` writes
            them; and the lamp's matrix.
    """
    depths, ends, matrix = shadows
    x, y, z = place
    one, zero, whole = np.float32(1), np.float32(0), np.float32(depths.shape[2])
    metre = np.float32(math.sqrt(matrix[2, 0] ** 2 + matrix[2, 1] ** 2 + matrix[2, 2] ** 2))
    facing = -(matrix[2, 0] * normal[0] + matrix[2, 1] * normal[1] + matrix[2, 2] * normal[2]) / metre
    # The more a surface is turned away, the more depth it has within the texels around.
    aside = np.float32(math.sqrt(max(one - facing * facing, zero)))
    near = np.float32(NEAR) + np.float32(ASIDE) * aside / max(facing, np.float32(0.2))
    u = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
    v = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
    depth = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3] - near * metre
    least, most = one, np.float32(SIDE - 2)
    i, j = int(min(max(u, least), most)), int(min(max(v, least), most))
    if ends[j, i, 0] >= depth:
        return one
    if ends[j, i, 1] <= depth - np.float32(SOFT) * metre:
        return zero
    s, t = u - np.float32(i), v - np.float32(j)
    soft = one / (np.float32(SOFT) * metre)
    seen = zero
    for row in range(-1, 2):
        wy = _share(row, t)
        for column in range(-1, 2):
            count = zero
            for k in range(depths.shape[2]):
                count += min(max((depths[j + row, i + column, k] - depth) * soft + one, zero), one)
            seen += wy * _share(column, s) * count
    return seen / whole


@compiled
def _share(step: Any, at: Any) -> Any:
    """Return the weight of the texel `step` away (-1, 0, 1) from one in which `at` 0..1 is the place."""
    f = min(max(at, np.float32(0)), np.float32(1)) - np.float32(0.5)
    if step == 0:
        return np.float32(0.75) - f * f
    near = np.float32(0.5) + np.float32(step) * f
    return np.float32(0.5) * near * near
