"""Soft shadows of the key lamp: a shadow map with percentage-closer filtering.

Source: Reeves, Salesin and Cook 1987, "Rendering antialiased shadows with depth maps", SIGGRAPH.
"""

import math
from typing import Any

import numpy as np

from realizer.render.compiled import compiled
from realizer.render.lamp_view import ASIDE, NEAR, SIDE, SOFT


@compiled
def reach(shadows: Any, place: Any, normal: Any) -> Any:
    """Return the share of the lamp that a place with that normal sees.

    Args:
        shadows: depths (SIDE, SIDE, k) of the samples of each texel, and the lamp's matrix.
    """
    depths, matrix = shadows
    x, y, z = place
    metre = np.float32(math.sqrt(matrix[2, 0] ** 2 + matrix[2, 1] ** 2 + matrix[2, 2] ** 2))
    facing = -(matrix[2, 0] * normal[0] + matrix[2, 1] * normal[1] + matrix[2, 2] * normal[2]) / metre
    # The more a surface is turned away, the more depth it has within the texels around.
    aside = np.float32(math.sqrt(max(np.float32(1) - facing * facing, np.float32(0))))
    near = np.float32(NEAR) + np.float32(ASIDE) * aside / max(facing, np.float32(0.2))
    u = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2] * z + matrix[0, 3]
    v = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2] * z + matrix[1, 3]
    depth = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2] * z + matrix[2, 3] - near * metre
    least, most = np.float32(1), np.float32(SIDE - 2)
    i, j = int(min(max(u, least), most)), int(min(max(v, least), most))
    s, t = u - np.float32(i), v - np.float32(j)
    soft = np.float32(1) / (np.float32(SOFT) * metre)
    seen = np.float32(0)
    for row in range(-1, 2):
        wy = _share(row, t)
        for column in range(-1, 2):
            count = np.float32(0)
            for k in range(depths.shape[2]):
                count += min(max((depths[j + row, i + column, k] - depth) * soft + np.float32(1), 0), 1)
            seen += wy * _share(column, s) * count
    return seen / np.float32(depths.shape[2])


@compiled
def _share(step: Any, at: Any) -> Any:
    """Return the weight of the texel `step` away (-1, 0, 1) from one in which `at` 0..1 is the place."""
    f = min(max(at, np.float32(0)), np.float32(1)) - np.float32(0.5)
    if step == 0:
        return np.float32(0.75) - f * f
    near = np.float32(0.5) + np.float32(step) * f
    return np.float32(0.5) * near * near
