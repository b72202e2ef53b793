"""Finds the triangle that is seen at each sample of a picture."""

from typing import Any

import numpy as np

from realizer.render.compiled import compiled
from realizer.render.textures import ALPHA

# Horizontal positions of the samples in a pixel, one in each row of a rotated grid, as in graphics cards.
SAMPLES = (0.375, 0.875, 0.125, 0.625)
LEAST = np.float32(0)


@compiled
def level_of(fixed: Any, levels: Any, corners: Any, turn: Any) -> Any:
    """Return the level of the maps whose texels are as large as pixels, for twice the area in pixels."""
    a, b, c = corners
    u, v = fixed[b, 0] - fixed[a, 0], fixed[b, 1] - fixed[a, 1]
    s, t = fixed[c, 0] - fixed[a, 0], fixed[c, 1] - fixed[a, 1]
    texels = abs(u * t - v * s) * levels[0, 1] * levels[0, 2]
    level, ratio = 0, texels / max(abs(turn), 1e-9)
    while ratio > 2.0 and level < len(levels) - 1:
        ratio *= 0.25
        level += 1
    return level


@compiled
def fill(
    points: Any, nearness: Any, triangles: Any, sides: Any, fixed: Any, texels: Any, rows: Any, samples: Any
) -> None:
    """Write the samples of all triangles that are nearer than the present samples, in a band of rows.

    Args:
        points, nearness, triangles: as in `Raster`.
        sides: (t,) uint8, 1 of triangles seen from both sides, 2 of those with holes.
        fixed: (d, k), the place in the maps first.
        texels: values and levels of the maps.
        rows: first and last + 1.
        samples: keys (h, w, samples) uint64, nearness and number + 1 of the triangle at each sample; and
            arrays to work in, as of `Raster`.
    """
    begin, stop = rows
    values, levels = texels
    keys, (firsts, lasts), (beside, _) = samples
    width = keys.shape[1]
    high_half = np.uint64(32)
    per = len(SAMPLES)
    pitch = 1.0 / per
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[a, 0], points[a, 1]
        ux, uy = points[b, 0] - ax, points[b, 1] - ay
        vx, vy = points[c, 0] - ax, points[c, 1] - ay
        # Intervals are half-open, so that a shared edge belongs to one triangle.
        top = int(np.ceil(max((ay + min(0.0, uy, vy)) * per - 0.5, float(begin * per))))
        end = int(np.ceil(min((ay + max(0.0, uy, vy)) * per - 0.5, float(stop * per))))
        if not top < end:
            continue
        turn = ux * vy - vx * uy
        if turn > 0 and sides[t] & 1:
            b, c, ux, uy, vx, vy, turn = c, b, vx, vy, ux, uy, -turn
        if not turn < 0:  # the back of a triangle, without area, or not a number
            continue
        # One long edge connects the highest and the lowest corner; two short ones meet at the third corner.
        high, mid, low = a, b, c
        if points[mid, 1] < points[high, 1]:
            high, mid = mid, high
        if points[low, 1] < points[mid, 1]:
            mid, low = low, mid
            if points[mid, 1] < points[high, 1]:
                high, mid = mid, high
        x0, y0, x1, y1, x2, y2 = (
            points[high, 0],
            points[high, 1],
            points[mid, 0],
            points[mid, 1],
            points[low, 0],
            points[low, 1],
        )
        # Edges are computed from their upper end, so that neighbours get exactly the same values.
        long_slope = (x2 - x0) / (y2 - y0)
        long_at = x0 - long_slope * y0
        bend = min(max(int(np.ceil(y1 * per - 0.5)), top), end)
        right = (x1 - x0) * (y2 - y0) > (x2 - x0) * (y1 - y0)  # the third corner
        # The change of a triangle's values per pixel to the right and down.
        px, py, qx, qy = vy / turn, vx / turn, uy / turn, ux / turn
        n0, n1, n2 = nearness[a], nearness[b] - nearness[a], nearness[c] - nearness[a]
        nx, ny = np.float32(n1 * px - n2 * qx), n2 * qy - n1 * py
        over, under = y1 - y0, y2 - y1
        upper_slope = (x1 - x0) / over if over > 0 else 0.0
        lower_slope = (x2 - x1) / under if under > 0 else 0.0
        upper_at, lower_at = x0 - upper_slope * y0, x1 - lower_slope * y1
        for k in range(per):
            beside[k] = nx * (sample_x(k) - 0.5) + ny * ((k + 0.5) * pitch - 0.5)
        holes, shift = sides[t] & 2, 0
        first_texel = wide = tall = 0
        if holes:
            first_texel, wide, tall = levels[level_of(fixed, levels, (a, b, c), turn)]
            shift = (t >> 4) * 2654435761 >> 7 & 3  # layers of hair cover other samples
        for line in range(top // per, (end + per - 1) // per):
            left, beyond = width, 0
            for k in range(per):
                row = line * per + k
                first, last = width, 0
                if top <= row < end:
                    y = (row + 0.5) * pitch
                    short = upper_slope * y + upper_at if row < bend else lower_slope * y + lower_at
                    long = long_slope * y + long_at
                    first = max(int(np.ceil((long if right else short) - sample_x(k))), 0)
                    last = min(int(np.ceil((short if right else long) - sample_x(k))), width)
                    if first < last:
                        left, beyond = min(left, first), max(beyond, last)
                firsts[k], lasts[k] = first, last
            dx, dy = left + 0.5 - ax, line + 0.5 - ay
            near = np.float32(n0 + nx * dx + ny * dy)
            for x in range(left, beyond):
                cover = 255
                if holes:
                    dx = x + 0.5 - ax
                    s, r = dx * px - dy * py, dy * qy - dx * qx
                    u = fixed[a, 0] + (fixed[b, 0] - fixed[a, 0]) * s + (fixed[c, 0] - fixed[a, 0]) * r
                    v = fixed[a, 1] + (fixed[b, 1] - fixed[a, 1]) * s + (fixed[c, 1] - fixed[a, 1]) * r
                    column = min(max(int(u * wide), 0), wide - 1)
                    cover = values[first_texel + min(max(int(v * tall), 0), tall - 1) * wide + column, ALPHA]
                for k in range(per):
                    if firsts[k] <= x < lasts[k] and cover > ((k + shift & 3) << 6) + 31:
                        here = np.float32(near + beside[k])
                        if here > LEAST:  # floats above 0 are in the order of their bits
                            key = (np.uint64(here.view(np.uint32)) << high_half) | np.uint64(t + 1)
                            if key > keys[line, x, k]:
                                keys[line, x, k] = key
                near += nx


@compiled
def sample_x(k: Any) -> Any:
    """Return the horizontal position of a sample in its pixel."""
    return SAMPLES[k]
