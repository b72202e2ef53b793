"""Finds what is seen in each sample of a picture, and the light that comes from there."""

import math
import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.colours import linear
from realizer.face.drawn_mesh import EYE, HAIR, DrawnMesh
from realizer.render.compiled import compiled
from realizer.render.lamp_view import SIDE, LampView
from realizer.render.shading import BRIGHTEST, STEPS, dot, reflected, tone_curve, unit
from realizer.render.shadows import reach
from realizer.render.surfaces import BENT, BOWL, surfaces
from realizer.render.textures import ALPHA, CHANNELS, DEPTH, IRIS, STEEPEST, Texels

# Horizontal positions of the samples in a pixel, one in each row of a rotated grid, as in graphics cards.
SAMPLES = (0.375, 0.875, 0.125, 0.625)
MAX_THREADS = 4
LEAST = np.float32(0)
# Samples of one kind are lit once where their nearness differs by less than this share, and the green of
# their triangles' colours by less than that.
SAME, TINT = np.float32(8e-4), np.float32(0.05)


class Raster:
    """Draws a mesh in pictures of one size; not thread-safe."""

    def __init__(
        self, size: tuple[int, int], mesh: DrawnMesh, colours: Float32, texels: Texels, lamp: LampView
    ) -> None:
        """Reserve the memory of a picture of (width, height) pixels.

        Args:
            colours: (d, 3) linear light, of the mesh's vertices.
            lamp: the view of the lamp that casts shadows.

        Raises:
            RenderError: numba is not installed; the text says what to install.
        """
        width, height = size
        # The samples of a pixel are adjacent, so that a small triangle writes to adjacent memory. A sample is
        # one number with nearness in the upper half and its triangle in the lower one, so that the greater
        # number is the nearer sample.
        self._keys = np.zeros((height, width, len(SAMPLES)), np.uint64)
        self._picture = np.zeros((height, width, 4), np.uint8)
        self._texels = texels.values, texels.levels
        self._triangles = mesh.triangles
        self._sides = mesh.two_sided.astype(np.uint8) | mesh.see_through.astype(np.uint8) << 1
        rough = 1 - np.float32(0.8) * mesh.gloss
        self._fixed = np.hstack([mesh.uv, colours, mesh.occlusion[:, None], rough[:, None]]).astype(
            np.float32
        )
        self._kind = mesh.kind
        # Each thread draws a band of rows; the loops release Python's lock.
        bands = max(1, min(MAX_THREADS, os.cpu_count() or 1, height))
        edges = [height * k // (4 * bands) for k in range(4 * bands + 1)]
        self._bands = list(pairwise(edges))
        self._pool = ThreadPoolExecutor(bands)
        self._lamp = lamp
        self._samples = np.zeros((SIDE, SIDE, len(SAMPLES)), np.uint64)
        self._shadow_bands = list(pairwise(SIDE * k // (2 * bands) for k in range(2 * bands + 1)))

    def __call__(self, points: Any, nearness: Float32, moving: Float32, lights: Any, eye: Float32) -> UInt8:
        """Return the picture (h, w, 4) uint8, premultiplied, from the top; it is valid until the next call.

        Args:
            points: (d, 2) pixels, x to the right and y down from the top left corner.
            nearness: (d,) 1 / distance, which is linear in the picture.
            moving: (d, 10) place and unit normal in metres, how much of the folds shows, and the direction
                of hairs.
            lights: as `shading.reflected` takes them.
            eye: (3,) place of the camera in metres.
        """
        points = np.ascontiguousarray(points, np.float64)
        nearness = np.ascontiguousarray(nearness, np.float32)
        mesh = (
            self._triangles,
            self._fixed,
            self._kind,
            surfaces(),
            linear(np.arange(256, dtype=np.uint8)),
            tone_curve(),
        )
        shadows = self._shadow_map(moving), self._lamp.matrix

        def band(rows: tuple[int, int]) -> None:
            room = _room()
            _fill(
                points,
                nearness,
                self._triangles,
                self._sides,
                self._fixed,
                self._texels,
                rows,
                (self._keys, *room),
            )
            _light_band(
                points,
                moving,
                mesh,
                self._texels,
                lights,
                (eye, shadows),
                rows,
                (self._keys, self._picture, *room),
            )

        list(self._pool.map(band, self._bands))
        return self._picture

    def _shadow_map(self, moving: Float32) -> Float32:
        points = self._lamp.project(moving[:, :3])
        # The nearer to the lamp, the greater; never 0.
        nearness = (1.5 - points[:, 2]).astype(np.float32)

        def band(rows: tuple[int, int]) -> None:
            part = self._samples[rows[0] : rows[1]]
            part[:] = 0
            _fill(
                points,
                nearness,
                self._triangles,
                self._sides,
                self._fixed,
                self._texels,
                rows,
                (self._samples, *_room()),
            )

        list(self._pool.map(band, self._shadow_bands))
        near = (self._samples >> np.uint64(32)).astype(np.uint32).view(np.float32)
        return np.where(near > 0, np.float32(1.5) - near, np.float32(2))

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()


def _room() -> tuple[Any, Any]:
    """Return arrays for a thread to work in: two of whole numbers and two of values, one a sample."""
    values = np.empty(len(SAMPLES), np.float32), np.empty(CHANNELS, np.float32)
    return (np.empty(len(SAMPLES), np.int64), np.empty(len(SAMPLES), np.int64)), values


@compiled
def _level(fixed: Any, levels: Any, corners: Any, turn: Any) -> Any:
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
def _fill(
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
            room to work in, of `_room`.
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
            beside[k] = nx * (samples_x(k) - 0.5) + ny * ((k + 0.5) * pitch - 0.5)
        holes, shift = sides[t] & 2, 0
        first_texel = wide = tall = 0
        if holes:
            first_texel, wide, tall = levels[_level(fixed, levels, (a, b, c), turn)]
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
                    first = max(int(np.ceil((long if right else short) - samples_x(k))), 0)
                    last = min(int(np.ceil((short if right else long) - samples_x(k))), width)
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
def samples_x(k: Any) -> Any:
    """Return the horizontal position of a sample in its pixel."""
    return SAMPLES[k]


@compiled
def _texel(texels: Any, level: Any, u: Any, v: Any, out: Any) -> None:
    """Write the maps' values at a place, (CHANNELS,) 0..255, between the four texels around it."""
    values, levels = texels
    first, wide, tall = levels[level]
    x, y = u * wide - np.float32(0.5), v * tall - np.float32(0.5)
    left, upper = math.floor(x), math.floor(y)
    fx, fy = np.float32(x - left), np.float32(y - upper)
    x0, x1 = min(max(left, 0), wide - 1), min(max(left + 1, 0), wide - 1)
    y0, y1 = first + min(max(upper, 0), tall - 1) * wide, first + min(max(upper + 1, 0), tall - 1) * wide
    one = np.float32(1)
    w00, w10, w01, w11 = (one - fx) * (one - fy), fx * (one - fy), (one - fx) * fy, fx * fy
    for k in range(CHANNELS):
        out[k] = (
            w00 * values[y0 + x0, k] + w10 * values[y0 + x1, k]
            + w01 * values[y1 + x0, k] + w11 * values[y1 + x1, k]
        )  # fmt: skip


@compiled
def _light_of(t: Any, x: Any, y: Any, points: Any, moving: Any, mesh: Any, texels: Any, view: Any) -> Any:
    """Return the light (r, g, b) of a triangle's point at pixel (x, y)."""
    triangles, fixed, kinds, rows, linear, _ = mesh
    half = np.float32(0.5)
    lights, (eye, shadows), texel = view
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    turn = ux * vy - vx * uy
    dx, dy = x - points[a, 0], y - points[a, 1]
    s, r = np.float32((dx * vy - dy * vx) / turn), np.float32((dy * ux - dx * uy) / turn)
    q = np.float32(1) - s - r
    u, v = (
        q * fixed[a, 0] + s * fixed[b, 0] + r * fixed[c, 0],
        q * fixed[a, 1] + s * fixed[b, 1] + r * fixed[c, 1],
    )
    level, kind, byte = _level(fixed, texels[1], (a, b, c), turn), kinds[a], np.float32(1 / 255)
    _texel(texels, level, u, v, texel)
    place = _mixed(moving, 0, a, b, c, (q, s, r))
    smooth = unit(_mixed(moving, 3, a, b, c, (q, s, r)))
    towards = unit((eye[0] - place[0], eye[1] - place[1], eye[2] - place[2]))
    # Hairs have the normals of the head that they grow on, whichever way their card is seen.
    if dot(smooth, towards) < 0 and turn > 0 and kind != HAIR:
        smooth = (-smooth[0], -smooth[1], -smooth[2])
    along, down, size = _frame(fixed, moving, (a, b, c))
    if kind == HAIR:
        down = unit(_mixed(moving, 7, a, b, c, (q, s, r)))
    su = sv = np.float32(0)
    if kind == EYE and texel[8] < 254:
        depth = np.float32(DEPTH) * (np.float32(1) - texel[8] * byte)
        dive = size * _dive(depth, smooth, towards)
        u, v = u - dive * dot(towards, along), v - dive * dot(towards, down)
        _texel(texels, level, u, v, texel)
        bowl = np.float32(BOWL / IRIS[2]) * min(depth / np.float32(0.0004), np.float32(1))
        su, sv = bowl * (u - np.float32(IRIS[0])), bowl * (v - np.float32(IRIS[1]))
    albedo = (
        linear[int(texel[0] + half)] * (q * fixed[a, 2] + s * fixed[b, 2] + r * fixed[c, 2]),
        linear[int(texel[1] + half)] * (q * fixed[a, 3] + s * fixed[b, 3] + r * fixed[c, 3]),
        linear[int(texel[2] + half)] * (q * fixed[a, 4] + s * fixed[b, 4] + r * fixed[c, 4]),
    )
    fold = q * moving[a, 6] + s * moving[b, 6] + r * moving[c, 6]
    scale = np.float32(STEEPEST / 127)
    su += (texel[4] - 128 + (texel[9] - 128) * fold) * scale
    sv += (texel[5] - 128 + (texel[10] - 128) * fold) * scale
    relief = unit((
        smooth[0] - su * along[0] - sv * down[0],
        smooth[1] - su * along[1] - sv * down[1],
        smooth[2] - su * along[2] - sv * down[2],
    ))  # fmt: skip
    occlusion = (q * fixed[a, 5] + s * fixed[b, 5] + r * fixed[c, 5]) * texel[6] * byte
    rough = max((q * fixed[a, 6] + s * fixed[b, 6] + r * fixed[c, 6]) * texel[7] * byte, np.float32(0.06))
    values = (occlusion, rough, texel[8] * byte, reach(shadows, place, smooth))
    return reflected(rows[kind], kind == HAIR, albedo, (relief, smooth, down), values, towards, lights)


@compiled
def _mixed(rows: Any, k: Any, a: Any, b: Any, c: Any, shares: Any) -> Any:
    """Return the mixture of three vertices' vectors in columns k to k + 2."""
    q, s, r = shares
    return (
        q * rows[a, k] + s * rows[b, k] + r * rows[c, k],
        q * rows[a, k + 1] + s * rows[b, k + 1] + r * rows[c, k + 1],
        q * rows[a, k + 2] + s * rows[b, k + 2] + r * rows[c, k + 2],
    )


@compiled
def _frame(fixed: Any, moving: Any, corners: Any) -> Any:
    """Return the unit vectors on a triangle along which u and v of the maps grow, and their scale, 1/m."""
    a, b, c = corners
    e = (moving[b, 0] - moving[a, 0], moving[b, 1] - moving[a, 1], moving[b, 2] - moving[a, 2])
    f = (moving[c, 0] - moving[a, 0], moving[c, 1] - moving[a, 1], moving[c, 2] - moving[a, 2])
    u, v = fixed[b, 0] - fixed[a, 0], fixed[b, 1] - fixed[a, 1]
    s, t = fixed[c, 0] - fixed[a, 0], fixed[c, 1] - fixed[a, 1]
    way = np.float32(1) if u * t - v * s > 0 else np.float32(-1)
    along = unit(((t * e[0] - v * f[0]) * way, (t * e[1] - v * f[1]) * way, (t * e[2] - v * f[2]) * way))
    down = unit(((u * f[0] - s * e[0]) * way, (u * f[1] - s * e[1]) * way, (u * f[2] - s * e[2]) * way))
    ef = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
    size = math.sqrt(abs(u * t - v * s) / math.sqrt(max(dot(ef, ef), 1e-30)))
    return along, down, np.float32(size)


@compiled
def _dive(depth: Any, n: Any, towards: Any) -> Any:
    """Return how far a ray has gone aside at a depth below the cornea, in lengths of `towards` along it."""
    c = dot(n, towards)
    bent = np.float32(BENT)
    return depth * bent / np.float32(math.sqrt(np.float32(1) - bent * bent * (np.float32(1) - c * c)))


@compiled
def _light_band(
    points: Any, moving: Any, mesh: Any, texels: Any, lights: Any, eye: Any, rows: Any, pictures: Any
) -> None:
    """Write the pixels of a band of rows, and clear its samples."""
    keys, picture, (found, _), (near, texel) = pictures
    triangles, fixed, kinds, curve = mesh[0], mesh[1], mesh[2], mesh[5]
    view = lights, eye, texel
    per = len(SAMPLES)
    nothing, low_half, high_half = np.uint64(0), np.uint64(0xFFFFFFFF), np.uint64(32)
    to_step = np.float32(STEPS - 1)
    for y in range(rows[0], rows[1]):
        for x in range(keys.shape[1]):
            red = green = blue = np.float32(0)
            count = 0
            for k in range(per):
                key = keys[y, x, k]
                found[k] = np.int64(key & low_half) - 1
                near[k] = np.uint32(key >> high_half).view(np.float32)
                keys[y, x, k] = nothing
            for k in range(per):
                t = found[k]
                if t < 0:
                    continue
                kind, weight, inside, sx, sy = kinds[triangles[t, 0]], 0, 0, 0.0, 0.0
                for j in range(k, per):
                    if found[j] == t:
                        sx += SAMPLES[j]
                        sy += (j + 0.5) / per
                        inside += 1
                    elif (
                        found[j] < 0
                        or kinds[triangles[found[j], 0]] != kind
                        or abs(near[j] - near[k]) > SAME * near[k]
                        or abs(fixed[triangles[found[j], 0], 3] - fixed[triangles[t, 0], 3]) > TINT
                    ):
                        continue
                    weight += 1
                    found[j] = -1
                light = _light_of(t, x + sx / inside, y + sy / inside, points, moving, mesh, texels, view)
                count += weight
                red += weight * curve[int(math.sqrt(min(max(light[0] / BRIGHTEST, 0), 1)) * to_step)]
                green += weight * curve[int(math.sqrt(min(max(light[1] / BRIGHTEST, 0), 1)) * to_step)]
                blue += weight * curve[int(math.sqrt(min(max(light[2] / BRIGHTEST, 0), 1)) * to_step)]
            part, half = np.float32(1 / per), np.float32(0.5)
            picture[y, x, 0] = np.uint8(red * part + half)
            picture[y, x, 1] = np.uint8(green * part + half)
            picture[y, x, 2] = np.uint8(blue * part + half)
            picture[y, x, 3] = np.uint8(255 * count / per + half)
