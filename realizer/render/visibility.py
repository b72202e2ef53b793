"""Finds the triangle that is seen at each sample of a picture."""

from typing import Any

import numpy as np

from realizer.render.compiled import compiled

# Horizontal positions of the samples in a pixel, one in each row of a rotated grid, as in graphics cards.
SAMPLES = (0.375, 0.875, 0.125, 0.625)
PLACES = np.array(SAMPLES)


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
def upwards(x: Any) -> Any:
    """Return the next whole number that is not less."""
    whole = int(x)
    return whole + (whole < x)


@compiled
def place(points: Any, k: Any) -> Any:
    """Return a point as two numbers."""
    return points[k, 0], points[k, 1]


@compiled
def sort(
    points: Any, nearness: Any, triangles: Any, sides: Any, starts: Any, lists: Any, counts: Any
) -> None:
    """Write the triangles that may be seen in each band of rows, in order.

    Args:
        points, nearness, triangles, sides: as of `fill`.
        starts: (bands + 1,) first row of each, and the height.
        lists: (bands, t) numbers of triangles; counts: (bands,).
    """
    per, bands = len(SAMPLES), len(counts)
    counts[:] = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        (ax, ay), (bx, by), (cx, cy) = place(points, a), place(points, b), place(points, c)
        turn = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if turn < 0 or (turn > 0 and sides[t] & 1):
            top = np.ceil(min(ay, by, cy) * per - 0.5)
            end = np.ceil(max(ay, by, cy) * per - 0.5)
            if top < end and min(nearness[a], nearness[b], nearness[c]) > 0:
                for band in range(bands):
                    if top < starts[band + 1] * per and end > starts[band] * per:
                        lists[band, counts[band]] = t
                        counts[band] += 1


@compiled
def fill(points: Any, nearness: Any, chosen: Any, mesh: Any, rows: Any, keys: Any) -> None:
    """Write the samples of triangles that are nearer than the present samples, in a band of rows.

    Args:
        points, nearness: as in `Raster`.
        chosen: numbers of the triangles.
        mesh: triangles as in `Raster`; sides (t,) uint8, 1 of triangles seen from both sides, 2 of those with
            holes; `fixed` (d, k), the place in the maps first; alpha 0..255 of all texels, and the levels.
        rows: first and last + 1.
        keys: (h, w, samples) uint64, nearness and number + 1 of the triangle at each sample.
    """
    begin, stop = rows
    triangles, sides, fixed, (alpha, levels) = mesh
    width, high_half = keys.shape[1], np.uint64(32)
    per = len(SAMPLES)
    pitch = 1.0 / per
    for t in chosen:
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
        (x0, y0), (x1, y1), (x2, y2) = place(points, high), place(points, mid), place(points, low)
        # Edges are computed from their upper end, so that neighbours get exactly the same values.
        long_slope = (x2 - x0) / (y2 - y0)
        long_at = x0 - long_slope * y0
        bend = min(max(int(np.ceil(y1 * per - 0.5)), top), end)
        right = (x1 - x0) * (y2 - y0) > (x2 - x0) * (y1 - y0)  # the third corner
        # The change of a triangle's values per pixel to the right and down.
        number = np.uint64(t + 1)
        px, py, qx, qy = vy / turn, vx / turn, uy / turn, ux / turn
        n0, n1, n2 = nearness[a], nearness[b] - nearness[a], nearness[c] - nearness[a]
        nx, ny = np.float32(n1 * px - n2 * qx), n2 * qy - n1 * py
        over, under = y1 - y0, y2 - y1
        upper_slope = (x1 - x0) / over if over > 0 else 0.0
        lower_slope = (x2 - x1) / under if under > 0 else 0.0
        upper_at, lower_at = x0 - upper_slope * y0, x1 - lower_slope * y1
        shift, first_texel, wide, tall = 0, 0, 0, 0
        u = v = u_right = u_down = v_right = v_down = 0.0
        pierced = sides[t] & 2
        if pierced:
            first_texel, wide, tall = levels[level_of(fixed, levels, (a, b, c), turn)]
            shift = (t >> 4) * 2654435761 >> 7 & 3  # layers of hair cover other samples
            u, u1, u2 = (
                wide * fixed[a, 0],
                wide * (fixed[b, 0] - fixed[a, 0]),
                wide * (fixed[c, 0] - fixed[a, 0]),
            )
            v, v1, v2 = (
                tall * fixed[a, 1],
                tall * (fixed[b, 1] - fixed[a, 1]),
                tall * (fixed[c, 1] - fixed[a, 1]),
            )
            u_right, u_down, v_right, v_down = (
                u1 * px - u2 * qx,
                u2 * qy - u1 * py,
                v1 * px - v2 * qx,
                v2 * qy - v1 * py,
            )
        for row in range(top, end):
            line, k = row // per, row % per
            y = (row + 0.5) * pitch
            short = upper_slope * y + upper_at if row < bend else lower_slope * y + lower_at
            long = long_slope * y + long_at
            aside = PLACES[k]
            left, beyond = (long, short) if right else (short, long)
            first, last = max(upwards(left - aside), 0), min(upwards(beyond - aside), width)
            near = np.float32(n0 + nx * (first + aside - ax) + ny * (y - ay))
            enough, middle = ((k + shift & 3) << 6) + 31, line + 0.5 - ay
            for x in range(first, last):
                # Floats above 0 are in the order of their bits.
                key = (np.uint64(np.float32(near).view(np.uint32)) << high_half) | number
                near += nx
                if key > keys[line, x, k]:
                    if pierced:
                        across = x + 0.5 - ax
                        column = min(max(int(u + u_right * across + u_down * middle), 0), wide - 1)
                        rank = min(max(int(v + v_right * across + v_down * middle), 0), tall - 1)
                        if alpha[first_texel + rank * wide + column] <= enough:
                            continue
                    keys[line, x, k] = key
