"""A triangle rasterizer on the processor; the only importer of numba."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.core.errors import RenderError

NO_NUMBA = "pictures without OpenGL need the render extra: pip install 'bml-realizer[render]'"
# Horizontal positions of the samples in a pixel, one in each row of a rotated grid, as in graphics cards.
SAMPLES = (0.375, 0.875, 0.125, 0.625)
MAX_THREADS = 4
LEAST, MOST = np.float32(0), np.float32(255.5)  # limits of a colour component


class Raster:
    """A rasterizer for pictures of one size; not thread-safe."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Reserve the memory of a picture of (width, height) pixels.

        Raises:
            RenderError: numba is not installed; the text says what to install.
        """
        self._loops = _compiled()
        width, height = size
        # The samples of a pixel are adjacent, so that a small triangle writes to adjacent memory. A sample is
        # one number with nearness in the upper half and colour in the lower one, so that the greater number
        # is the nearer sample.
        self._keys = np.zeros((height, width, len(SAMPLES)), np.uint64)
        self._picture = np.zeros((height, width), np.uint32)
        # Each thread draws a band of rows; the loops release Python's lock.
        bands = max(1, min(MAX_THREADS, os.cpu_count() or 1, height))
        edges = [height * k // bands for k in range(bands + 1)]
        self._bands = list(pairwise(edges))
        self._pool = ThreadPoolExecutor(bands)

    def __call__(self, points: Any, nearness: Float32, triangles: Int32, colours: Float32) -> UInt8:
        """Return the picture (h, w, 4) uint8, premultiplied, from the top; it is valid until the next call.

        Args:
            points: (n, 2) pixels, x to the right and y down from the top left corner.
            nearness: (n,) 1 / distance, which is linear in the picture.
            triangles: (m, 3); those that are not counter-clockwise in the picture are invisible.
            colours: (n, 3) sRGB 0..1.
        """
        fill, mean = self._loops
        points = np.ascontiguousarray(points, np.float64)
        nearness = np.ascontiguousarray(nearness, np.float32)
        tones = np.ascontiguousarray(colours * np.float32(255) + np.float32(0.5), np.float32)

        def band(rows: tuple[int, int]) -> None:
            part = slice(*rows)
            fill(points, nearness, triangles, tones, SAMPLES, *rows, self._keys)
            mean(self._keys[part], self._picture[part])

        list(self._pool.map(band, self._bands))
        return self._picture.view(np.uint8).reshape(*self._picture.shape, 4)

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()


@cache
def _compiled() -> tuple[Callable[..., None], ...]:
    """Return the two loops below as machine code, which is cached on disk if possible."""
    try:
        import numba
    except ImportError as error:
        raise RenderError(f"{NO_NUMBA} ({error})") from None
    options: Any = {"nogil": True, "error_model": "numpy"}
    try:
        return tuple(numba.njit(cache=True, **options)(loop) for loop in (_fill, _mean))
    except RuntimeError:  # neither our folder nor the user's can be written
        return tuple(numba.njit(**options)(loop) for loop in (_fill, _mean))


def _fill(
    points: Any, nearness: Any, triangles: Any, colours: Any, samples: Any, begin: int, stop: int, keys: Any
) -> None:
    """Write the samples of all triangles that are nearer than the present samples, in rows `begin` to `stop`.

    Args:
        points, nearness, triangles: as in `Raster.__call__`.
        colours: (n, 3) 0.5..255.5.
        samples: `SAMPLES`.
        keys: (h, w, samples) uint64, nearness and RGBA of each sample.
    """
    width = keys.shape[1]
    high_half = np.uint64(32)
    per = len(samples)
    pitch = 1.0 / per
    firsts, lasts = np.empty(per, np.int64), np.empty(per, np.int64)
    beside = np.empty(per, np.float32)  # nearness of a sample relative to the middle of its pixel
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = points[a, 0], points[a, 1]
        ux, uy = points[b, 0] - ax, points[b, 1] - ay
        vx, vy = points[c, 0] - ax, points[c, 1] - ay
        turn = ux * vy - vx * uy
        if not turn < 0:  # the back of a triangle, without area, or not a number
            continue
        # Intervals are half-open, so that a shared edge belongs to one triangle.
        top = int(np.ceil(max((ay + min(0.0, uy, vy)) * per - 0.5, float(begin * per))))
        end = int(np.ceil(min((ay + max(0.0, uy, vy)) * per - 0.5, float(stop * per))))
        if top >= end:
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
        r0, r1, r2 = colours[a, 0], colours[b, 0] - colours[a, 0], colours[c, 0] - colours[a, 0]
        g0, g1, g2 = colours[a, 1], colours[b, 1] - colours[a, 1], colours[c, 1] - colours[a, 1]
        b0, b1, b2 = colours[a, 2], colours[b, 2] - colours[a, 2], colours[c, 2] - colours[a, 2]
        nx, rx = np.float32(n1 * px - n2 * qx), np.float32(r1 * px - r2 * qx)
        gx, bx = np.float32(g1 * px - g2 * qx), np.float32(b1 * px - b2 * qx)
        ny, ry, gy, by = n2 * qy - n1 * py, r2 * qy - r1 * py, g2 * qy - g1 * py, b2 * qy - b1 * py
        over, under = y1 - y0, y2 - y1
        upper_slope = (x1 - x0) / over if over > 0 else 0.0
        lower_slope = (x2 - x1) / under if under > 0 else 0.0
        upper_at, lower_at = x0 - upper_slope * y0, x1 - lower_slope * y1
        for k in range(per):
            beside[k] = nx * (samples[k] - 0.5) + ny * ((k + 0.5) * pitch - 0.5)
        for line in range(top // per, (end + per - 1) // per):
            left, beyond = width, 0
            for k in range(per):
                row = line * per + k
                first, last = width, 0
                if top <= row < end:
                    y = (row + 0.5) * pitch
                    short = upper_slope * y + upper_at if row < bend else lower_slope * y + lower_at
                    long = long_slope * y + long_at
                    first = max(int(np.ceil((long if right else short) - samples[k])), 0)
                    last = min(int(np.ceil((short if right else long) - samples[k])), width)
                    if first < last:
                        left, beyond = min(left, first), max(beyond, last)
                firsts[k], lasts[k] = first, last
            # One colour a pixel, that of its middle; one depth a sample.
            dx, dy = left + 0.5 - ax, line + 0.5 - ay
            near, red = np.float32(n0 + nx * dx + ny * dy), np.float32(r0 + rx * dx + ry * dy)
            green, blue = np.float32(g0 + gx * dx + gy * dy), np.float32(b0 + bx * dx + by * dy)
            for x in range(left, beyond):
                # The middle may lie beside the triangle.
                tone = np.uint64(
                    np.int64(min(max(red, LEAST), MOST))
                    | (np.int64(min(max(green, LEAST), MOST)) << 8)
                    | (np.int64(min(max(blue, LEAST), MOST)) << 16)
                    | np.int64(0xFF000000)
                )
                for k in range(per):
                    if firsts[k] <= x < lasts[k]:
                        here = np.float32(near + beside[k])
                        if here > LEAST:  # floats above 0 are in the order of their bits
                            key = (np.uint64(here.view(np.uint32)) << high_half) | tone
                            if key > keys[line, x, k]:
                                keys[line, x, k] = key
                near += nx
                red += rx
                green += gx
                blue += bx


def _mean(keys: Any, picture: Any) -> None:
    """Write the mean of each pixel's four samples, all four bytes at once; clear the samples."""
    height, width = picture.shape
    nothing = np.uint64(0)
    upper, lower, half = np.uint32(0x3F3F3F3F), np.uint32(0x03030303), np.uint32(0x02020202)
    two = np.uint32(2)
    for y in range(height):
        for x in range(width):
            first, second, third, fourth = keys[y, x, 0], keys[y, x, 1], keys[y, x, 2], keys[y, x, 3]
            if (first | second | third | fourth) == nothing:
                picture[y, x] = 0
                continue
            keys[y, x, 0] = keys[y, x, 1] = keys[y, x, 2] = keys[y, x, 3] = nothing
            a, b, c, d = np.uint32(first), np.uint32(second), np.uint32(third), np.uint32(fourth)
            quarters = (
                ((a >> two) & upper) + ((b >> two) & upper) + ((c >> two) & upper) + ((d >> two) & upper)
            )
            rest = (a & lower) + (b & lower) + (c & lower) + (d & lower) + half
            picture[y, x] = quarters + ((rest >> two) & lower)
