"""The light that comes from what is seen in a picture: numba's version of `surface.glsl`."""

import math
from typing import Any

import numpy as np

from realizer.face.drawn_mesh import EYE, HAIR
from realizer.render.compiled import compiled
from realizer.render.shading import BRIGHTEST, STEPS, dot, mirrored, reflected, unit
from realizer.render.shadows import reach
from realizer.render.surfaces import BENT, BOWL
from realizer.render.textures import CHANNELS, DEPTH, FOLD_SHADE, IRIS, STEEPEST
from realizer.render.visibility import SAMPLES, level_of

# Samples of one kind are lit once where their nearness differs by less than this share, and the green of
# their triangles' colours by less than that.
SAME, TINT = np.float32(8e-4), np.float32(0.05)
SETUPS = 512  # triangles whose setup a thread keeps
# Columns of a setup: what is fixed and what moves at the first corner, and the steps to the two others; the
# directions in which u and v grow, with the scale; place in the picture, and changes to the right and down.
FIXED, MOVING, ONE, OTHER, ALONG, DOWN, SCALE, CORNER, CHANGES, SETUP = 0, 7, 17, 34, 51, 54, 57, 58, 60, 64
# Rows of points that are lit together. The light replaces the place, the direction that is mirrored and its
# share replace the normal and the first of the strand.
ROOM, PLACE, NORMAL, STRAND, SLOPE, ALBEDO, VALUES, ROWS = 256, 0, 3, 6, 9, 12, 15, 19
TOGETHER = 16  # points are lit in multiples of this, so that none is left over


@compiled
def _texel(texels: Any, level: Any, u: Any, v: Any, out: Any) -> None:
    """Write the maps' values at a place, (CHANNELS,) 0..255, between the four texels around it."""
    values, levels = texels
    first, wide, tall = levels[level, 0], levels[level, 1], levels[level, 2]
    x, y = u * np.float32(wide) - np.float32(0.5), v * np.float32(tall) - np.float32(0.5)
    left, upper = math.floor(x), math.floor(y)
    fx, fy = x - np.float32(left), y - np.float32(upper)
    x0, x1 = min(max(left, 0), wide - 1), min(max(left + 1, 0), wide - 1)
    y0, y1 = first + min(max(upper, 0), tall - 1) * wide, first + min(max(upper + 1, 0), tall - 1) * wide
    one = np.float32(1)
    w00, w10, w01, w11 = (one - fx) * (one - fy), fx * (one - fy), (one - fx) * fy, fx * fy
    for k in range(CHANNELS):
        out[k] = (
            w00 * np.float32(values[y0 + x0, k]) + w10 * np.float32(values[y0 + x1, k])
            + w01 * np.float32(values[y1 + x0, k]) + w11 * np.float32(values[y1 + x1, k])
        )  # fmt: skip


@compiled
def _set_up(t: Any, points: Any, moving: Any, mesh: Any, levels: Any, setup: Any, numbers: Any) -> None:
    """Write the setup of a triangle; and its number, the level of the maps, and whether it is the back."""
    triangles, fixed = mesh[0], mesh[1]
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    turn = ux * vy - vx * uy
    for k in range(MOVING):
        setup[k] = fixed[a, k]
        setup[ONE + k], setup[OTHER + k] = fixed[b, k] - fixed[a, k], fixed[c, k] - fixed[a, k]
    for k in range(ONE - MOVING):
        at = MOVING + k
        setup[at] = moving[a, k]
        setup[ONE + at], setup[OTHER + at] = moving[b, k] - moving[a, k], moving[c, k] - moving[a, k]
    along, down, scale = _frame(setup)
    for k in range(3):
        setup[ALONG + k], setup[DOWN + k] = along[k], down[k]
    setup[SCALE], setup[CORNER], setup[CORNER + 1] = scale, points[a, 0], points[a, 1]
    setup[CHANGES], setup[CHANGES + 1] = vy / turn, vx / turn
    setup[CHANGES + 2], setup[CHANGES + 3] = uy / turn, ux / turn
    numbers[0], numbers[1], numbers[2] = t, level_of(fixed, levels, (a, b, c), turn), turn > 0


@compiled
def _vector(values: Any, k: Any) -> Any:
    """Return three values from `k` on."""
    return values[k], values[k + 1], values[k + 2]


@compiled
def _frame(setup: Any) -> Any:
    """Return the unit vectors on a triangle along which u and v of the maps grow, and their scale, 1/m."""
    e, f = _vector(setup, ONE + MOVING), _vector(setup, OTHER + MOVING)
    u, v, s, t = setup[ONE], setup[ONE + 1], setup[OTHER], setup[OTHER + 1]
    way = np.float32(1) if u * t - v * s > 0 else np.float32(-1)
    along = unit(((t * e[0] - v * f[0]) * way, (t * e[1] - v * f[1]) * way, (t * e[2] - v * f[2]) * way))
    down = unit(((u * f[0] - s * e[0]) * way, (u * f[1] - s * e[1]) * way, (u * f[2] - s * e[2]) * way))
    ef = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
    size = math.sqrt(abs(u * t - v * s) / math.sqrt(max(dot(ef, ef), np.float32(1e-30))))
    return along, down, np.float32(size)


@compiled
def _dive(depth: Any, n: Any, towards: Any) -> Any:
    """Return how far a ray has gone aside at a depth below the cornea, in lengths of `towards` along it."""
    c = dot(n, towards)
    bent = np.float32(BENT)
    return depth * bent / np.float32(math.sqrt(np.float32(1) - bent * bent * (np.float32(1) - c * c)))


@compiled
def _point(
    setup: Any, numbers: Any, kind: Any, x: Any, y: Any, texels: Any, eye: Any, shadows: Any, linear: Any,
    out: Any, i: Any, room: Any,
) -> None:  # fmt: skip
    """Write point `i` of those that are lit together: that of a triangle at pixel (x, y)."""
    values, texel = room
    one, byte, half, zero_slope = np.float32(1), np.float32(1 / 255), np.float32(0.5), np.float32(128)
    dx, dy = x - setup[CORNER], y - setup[CORNER + 1]
    s = dx * setup[CHANGES] - dy * setup[CHANGES + 1]
    r = dy * setup[CHANGES + 3] - dx * setup[CHANGES + 2]
    for k in range(ONE):
        values[k] = setup[k] + s * setup[ONE + k] + r * setup[OTHER + k]
    u, v = values[0], values[1]
    _texel(texels, numbers[1], u, v, texel)
    place, smooth, fold = _vector(values, MOVING), unit(_vector(values, MOVING + 3)), values[MOVING + 6]
    su = sv = np.float32(0)
    along, down = _vector(setup, ALONG), _vector(setup, DOWN)
    if numbers[2] or kind == EYE:
        towards = unit((eye[0] - place[0], eye[1] - place[1], eye[2] - place[2]))
        # Hairs have the normals of the head that they grow on, whichever way their card is seen.
        if dot(smooth, towards) < 0 and numbers[2] and kind != HAIR:
            smooth = (-smooth[0], -smooth[1], -smooth[2])
        if kind == EYE and texel[8] < 254:
            depth = np.float32(DEPTH) * (one - texel[8] * byte)
            dive = setup[SCALE] * _dive(depth, smooth, towards)
            u, v = u - dive * dot(towards, along), v - dive * dot(towards, down)
            _texel(texels, numbers[1], u, v, texel)
            bowl = np.float32(BOWL / IRIS[2]) * min(depth / np.float32(0.0004), one)
            su, sv = bowl * (u - np.float32(IRIS[0])), bowl * (v - np.float32(IRIS[1]))
    scale = np.float32(STEEPEST / 127)
    su += (texel[4] - zero_slope + (texel[9] - zero_slope) * fold) * scale
    sv += (texel[5] - zero_slope + (texel[10] - zero_slope) * fold) * scale
    for k in range(3):
        out[(PLACE + k) * ROOM + i] = place[k]
        out[(NORMAL + k) * ROOM + i] = smooth[k]
        out[(STRAND + k) * ROOM + i] = values[MOVING + 7 + k]
        out[(SLOPE + k) * ROOM + i] = su * along[k] + sv * down[k]
        out[(ALBEDO + k) * ROOM + i] = linear[int(texel[k] + half)] * values[2 + k]
    occlusion = values[5] * texel[6] * byte * (one - np.float32(FOLD_SHADE) * fold * texel[11] * byte)
    out[VALUES * ROOM + i] = occlusion
    out[(VALUES + 1) * ROOM + i] = max(values[6] * texel[7] * byte, np.float32(0.06))
    out[(VALUES + 2) * ROOM + i] = texel[8] * byte
    out[(VALUES + 3) * ROOM + i] = reach(shadows, place, smooth)


@compiled
def _row(points: Any, k: Any, i: Any) -> Any:
    """Return the vector of point `i` in rows `k` to `k` + 2."""
    return points[k * ROOM + i], points[(k + 1) * ROOM + i], points[(k + 2) * ROOM + i]


@compiled
def _lit(points: Any, count: Any, surface: Any, hair: Any, coat: Any, lights: Any, eye: Any) -> None:
    """Replace the places of points of one kind by their light, and what follows by what they mirror."""
    for i in range(count):
        place, smooth, slope = _row(points, PLACE, i), _row(points, NORMAL, i), _row(points, SLOPE, i)
        towards = unit((eye[0] - place[0], eye[1] - place[1], eye[2] - place[2]))
        relief = unit((smooth[0] - slope[0], smooth[1] - slope[1], smooth[2] - slope[2]))
        normals = relief, smooth, _row(points, STRAND, i)
        values = (*_row(points, VALUES, i), points[(VALUES + 3) * ROOM + i])
        albedo = _row(points, ALBEDO, i)
        light, mirrored, share = reflected(surface, hair, coat, albedo, normals, values, towards, lights)
        points[i], points[ROOM + i], points[2 * ROOM + i] = light
        points[3 * ROOM + i], points[4 * ROOM + i], points[5 * ROOM + i] = mirrored
        points[STRAND * ROOM + i] = share


@compiled
def _add(kind: Any, count: Any, points: Any, into: Any, mesh: Any, lights: Any, eye: Any) -> None:
    """Light points of one kind, and add their colours to the pixels of a row."""
    lamps, levels = lights
    columns, weights, sums = into
    curve, surface = mesh[5], mesh[3][kind]
    full = (count + TOGETHER - 1) // TOGETHER * TOGETHER
    if kind == HAIR:
        _lit(points, full, surface, True, False, lamps, eye)
    elif kind == EYE:
        _lit(points, full, surface, False, True, lamps, eye)
    else:
        _lit(points, full, surface, False, False, lamps, eye)
    zero, one, bright, to_step = (
        np.float32(0),
        np.float32(1),
        np.float32(1 / BRIGHTEST),
        np.float32(STEPS - 1),
    )
    for i in range(count):
        light, share = _row(points, PLACE, i), points[STRAND * ROOM + i]
        if share > zero:
            sky = mirrored(levels, _row(points, NORMAL, i), points[(VALUES + 1) * ROOM + i])
            light = light[0] + share * sky[0], light[1] + share * sky[1], light[2] + share * sky[2]
        for k in range(3):
            step = np.float32(math.sqrt(min(max(light[k] * bright, zero), one))) * to_step
            sums[columns[i], k] += weights[i] * curve[int(step)]
        sums[columns[i], 3] += weights[i]


@compiled
def light_band(
    points: Any, moving: Any, mesh: Any, texels: Any, lights: Any, eye: Any, rows: Any, pictures: Any
) -> None:
    """Write the pixels of a band of rows, and clear its samples."""
    keys, picture, room = pictures
    (found, numbers, counts, columns), (near, values, texel, setups, lit, weights, sums) = room
    triangles, fixed, kinds, linear = mesh[0], mesh[1], mesh[2], mesh[4]
    place, shadows = eye
    per = len(SAMPLES)
    nothing, low_half, high_half = np.uint64(0), np.uint64(0xFFFFFFFF), np.uint64(32)
    numbers[:, 0] = -1
    counts[:] = 0
    for y in range(rows[0], rows[1]):
        sums[:] = 0
        for x in range(keys.shape[1]):
            if keys[y, x, 0] | keys[y, x, 1] | keys[y, x, 2] | keys[y, x, 3] == nothing:
                continue
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
                slot, i = t % SETUPS, counts[kind]
                if numbers[slot, 0] != t:
                    _set_up(t, points, moving, mesh, texels[1], setups[slot], numbers[slot])
                px, py = np.float32(x + sx / inside), np.float32(y + sy / inside)
                _point(
                    setups[slot], numbers[slot], kind, px, py, texels, place, shadows, linear,
                    lit[kind], i, (values, texel),
                )  # fmt: skip
                columns[kind, i], weights[kind, i] = x, weight
                counts[kind] = i + 1
                if i + 1 == ROOM:
                    _add(kind, ROOM, lit[kind], (columns[kind], weights[kind], sums), mesh, lights, place)
                    counts[kind] = 0
        for kind in range(len(counts)):
            if counts[kind]:
                into = columns[kind], weights[kind], sums
                _add(kind, counts[kind], lit[kind], into, mesh, lights, place)
                counts[kind] = 0
        part, half = np.float32(1 / per), np.float32(0.5)
        for x in range(keys.shape[1]):
            for k in range(3):
                picture[y, x, k] = np.uint8(sums[x, k] * part + half)
            picture[y, x, 3] = np.uint8(sums[x, 3] * np.float32(255 / per) + half)
