"""Points in pixels, triangles and colours in; pixels out, by the processor. The only importer of numba."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.arrays import Float32, Int32, UInt8
from realizer.errors import RenderError

__all__ = ["Raster", "ready"]

NO_NUMBA = "pictures without OpenGL need the render extra: pip install 'bml-realizer[render]'"
# Where in a pixel its samples stand, a row of samples each: in the middle, or on a turned grid, no two in
# one column, as graphics cards place four.
PLAIN = (0.5,)
SMOOTH = (0.375, 0.875, 0.125, 0.625)
THREADS = 4  # at most


class Raster:
    """Memory for pictures of one size, drawn again and again; one thread at a time."""

    def __init__(self, size: tuple[int, int], *, smooth: bool = True) -> None:
        """Nothing is compiled yet.

        Args:
            size: width, height in pixels.
            smooth: four samples a pixel, otherwise one.
        """
        width, height = size
        self._samples = np.array(SMOOTH if smooth else PLAIN, np.float64)
        rows = height * len(self._samples)
        self._nearest = np.zeros((rows, width), np.float32)
        self._tones = np.zeros((rows, width), np.uint32)
        self._picture = np.zeros((height, width), np.uint32)
        # A band of rows for each processor: the loops let go of Python's lock.
        bands = max(1, min(THREADS, os.cpu_count() or 1, height))
        edges = [height * k // bands for k in range(bands + 1)]
        self._bands = list(pairwise(edges))
        self._pool = ThreadPoolExecutor(bands)

    def __call__(self, points: Any, nearness: Float32, triangles: Int32, colours: Float32) -> UInt8:
        """(h, w, 4) uint8, premultiplied, row 0 at the top; valid until the next call.

        Args:
            points: (n, 2) pixels, x to the right and y down from the top left corner.
            nearness: (n,), above 0, more is nearer and straight across the picture: one over the distance.
            triangles: (m, 3); what is not counter-clockwise as one sees it is left out.
            colours: (n, 3) sRGB 0..1.

        Raises:
            RenderError: no numba; the text says what to install.
        """
        fill, mean = _compiled()
        points = np.ascontiguousarray(points, np.float64)
        nearness = np.ascontiguousarray(nearness, np.float32)
        # Samples lie inside their triangle: no tone leaves its corners' by more than rounding.
        tones = np.ascontiguousarray(colours * np.float32(254.9) + np.float32(0.52), np.float32)

        def band(rows: tuple[int, int]) -> None:
            first, last = (n * len(self._samples) for n in rows)
            self._nearest[first:last] = 0
            self._tones[first:last] = 0
            fill(points, nearness, triangles, tones, self._samples, first, last, self._nearest, self._tones)
            mean(self._tones[first:last], len(self._samples), self._picture[slice(*rows)])

        list(self._pool.map(band, self._bands))
        return self._picture.view(np.uint8).reshape(*self._picture.shape, 4)

    def close(self) -> None:
        """End its threads."""
        self._pool.shutdown()


def ready() -> str | None:
    """None where `Raster` can draw; otherwise a sentence that says what to install."""
    try:
        _compiled()
    except RenderError as error:
        return str(error)
    return None


@cache
def _compiled() -> tuple[Callable[..., None], Callable[..., None]]:
    """The two loops below as machine code; kept on disk where a place can be written, so compiled once."""
    try:
        import numba
    except ImportError as error:
        raise RenderError(f"{NO_NUMBA} ({error})") from None
    options: Any = {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(_fill), numba.njit(cache=True, **options)(_mean)
    except RuntimeError:  # neither our folder nor the user's can be written
        return numba.njit(**options)(_fill), numba.njit(**options)(_mean)


def _fill(
    points: Any,
    nearness: Any,
    triangles: Any,
    colours: Any,
    samples: Any,
    begin: int,
    stop: int,
    nearest: Any,
    tones: Any,
) -> None:
    """Write each triangle's samples where nothing nearer is: nearness, and RGBA in one number.

    Args as `Raster.__call__`, but colours 0.5..255.5; `nearest` and `tones` are (rows of samples, w), and
    those rows from `begin` to `stop` are written.
    """
    width = nearest.shape[1]
    per = len(samples)
    lowest, highest = np.empty(3), np.empty(3)  # rows that an edge spans
    slope, at = np.empty(3), np.empty(3)
    rises = np.empty(3, np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[a, 0], points[a, 1]
        ux, uy = points[b, 0] - ax, points[b, 1] - ay
        vx, vy = points[c, 0] - ax, points[c, 1] - ay
        turn = ux * vy - vx * uy
        if not turn < 0:  # seen from behind, without area, or not a number
            continue
        # Half-open, so that what two triangles share belongs to one of them.
        top = int(np.ceil(max((ay + min(0.0, uy, vy)) * per - 0.5, float(begin))))
        end = int(np.ceil(min((ay + max(0.0, uy, vy)) * per - 0.5, float(stop))))
        if top >= end:
            continue
        for k in range(3):
            i, j = triangles[t, k], triangles[t, (k + 1) % 3]
            x0, y0, x1, y1 = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            rises[k] = y1 > y0
            if y1 < y0:  # from its upper end, whichever triangle asks
                x0, y0, x1, y1 = x1, y1, x0, y0
            slope[k] = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
            at[k] = x0 - slope[k] * y0
            lowest[k], highest[k] = y0, y1
        # What a triangle carries grows by so much a pixel to the right and down.
        px, py, qx, qy = vy / turn, vx / turn, uy / turn, ux / turn
        n0, n1, n2 = nearness[a], nearness[b] - nearness[a], nearness[c] - nearness[a]
        r0, r1, r2 = colours[a, 0], colours[b, 0] - colours[a, 0], colours[c, 0] - colours[a, 0]
        g0, g1, g2 = colours[a, 1], colours[b, 1] - colours[a, 1], colours[c, 1] - colours[a, 1]
        b0, b1, b2 = colours[a, 2], colours[b, 2] - colours[a, 2], colours[c, 2] - colours[a, 2]
        nx, rx = np.float32(n1 * px - n2 * qx), np.float32(r1 * px - r2 * qx)
        gx, bx = np.float32(g1 * px - g2 * qx), np.float32(b1 * px - b2 * qx)
        ny, ry, gy, by = n2 * qy - n1 * py, r2 * qy - r1 * py, g2 * qy - g1 * py, b2 * qy - b1 * py
        for row in range(top, end):
            y = (row + 0.5) / per
            shift = samples[row % per]
            low, high = 0.0, width + shift
            for k in range(3):
                if lowest[k] < highest[k]:
                    edge = slope[k] * y + at[k]
                    if rises[k]:
                        low = max(low, edge)
                    else:
                        high = min(high, edge)
            first, last = int(np.ceil(low - shift)), min(int(np.ceil(high - shift)), width)
            if first >= last:
                continue
            dx, dy = first + shift - ax, y - ay
            near, red = np.float32(n0 + nx * dx + ny * dy), np.float32(r0 + rx * dx + ry * dy)
            green, blue = np.float32(g0 + gx * dx + gy * dy), np.float32(b0 + bx * dx + by * dy)
            for x in range(first, last):
                if near > nearest[row, x]:
                    nearest[row, x] = near
                    tones[row, x] = (
                        np.int32(red) | (np.int32(green) << 8) | (np.int32(blue) << 16) | np.int64(0xFF000000)
                    )
                near += nx
                red += rx
                green += gx
                blue += bx


def _mean(tones: Any, per: int, picture: Any) -> None:
    """The mean of each pixel's samples, of which four stand one below the other; all four bytes at once."""
    height, width = picture.shape
    if per == 1:
        picture[:] = tones
        return
    upper, lower, half = np.uint32(0x3F3F3F3F), np.uint32(0x03030303), np.uint32(0x02020202)
    two = np.uint32(2)
    for y in range(height):
        for x in range(width):
            a, b, c, d = tones[4 * y, x], tones[4 * y + 1, x], tones[4 * y + 2, x], tones[4 * y + 3, x]
            quarters = (
                ((a >> two) & upper) + ((b >> two) & upper) + ((c >> two) & upper) + ((d >> two) & upper)
            )
            rest = (a & lower) + (b & lower) + (c & lower) + (d & lower) + half
            picture[y, x] = quarters + ((rest >> two) & lower)
