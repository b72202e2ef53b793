"""The light that comes from what is seen in a picture: numba's version of `surface.glsl`."""

import math
from typing import Any

import numpy as np

from realizer.face.drawn_mesh import EYE, HAIR
from realizer.render.compiled import compiled
from realizer.render.shading import BRIGHTEST, STEPS, dot, mirrored, reflected, unit
from realizer.render.shadows import reach
from realizer.render.surfaces import BENT, BOWL
from realizer.render.textures import DEPTH, FOLD_SHADE, IRIS, STEEPEST, THICKNESS
from realizer.render.visibility import SAMPLES, level_of

# Samples of one kind are lit once where their nearness differs by less than this share, and the green of
# their triangles' colours by less than that.
SAME, TINT = np.float32(8e-4), np.float32(0.05)
SETUPS = 512  # triangles whose setup a thread keeps
# Rows of points that are lit together, and columns of a setup: what is fixed and what moves, then what is the
# same all over a triangle: directions in which u and v grow, their scale, and the level of the
UV, COLOUR, OCCLUDED, ROUGH, PLACE, NORMAL, FOLD, STRAND = 0, 2, 5, 6, 7, 10, 13, 14
VARIED, ALONG, DOWN, SCALE, LEVEL, REACHED, ROWS = 17, 17, 20, 23, 24, 27, 28
# In a setup the former are those of the first corner. Steps to the two others follow, the place of the corner
# in the picture, and how much of the steps a pixel to the right and down is.
ONE, OTHER, CORNER, CHANGES, SETUP = 27, 44, 61, 63, 67
# Results replace the first rows.
LIGHT, MIRRORED, SHARE = 0, 3, 7
ROOM = 256  # points at most
TOGETHER = 16  # points are lit in multiples of this, so that none is left over


@compiled
def _taps(texels: Any, level: Any, u: Any, v: Any) -> Any:
    """Return `texels`, (n, 3) uint32, the numbers of the four around a place, and their weights."""
    first, wide, tall = level
    half, zero, one = np.float32(0.5), np.float32(0), np.float32(1)
    x, y = min(max(u * wide - half, zero), wide - one), min(max(v * tall - half, zero), tall - one)
    left, upper, side = np.int32(x), np.int32(y), np.int32(wide)
    fx, fy = x - np.float32(left), y - np.float32(upper)
    right = min(left + 1, side - 1)
    up, down = np.int32(first) + upper * side, np.int32(first) + min(upper + 1, np.int32(tall) - 1) * side
    four = np.uint64(up + left), np.uint64(up + right), np.uint64(down + left), np.uint64(down + right)
    return texels, four, ((one - fx) * (one - fy), fx * (one - fy), (one - fx) * fy, fx * fy)


@compiled
def _mixed(texel: Any, k: Any) -> Any:
    """Return channels 4 k to 4 k + 3 of the maps, 0..255, between four texels, as `_taps` returns them."""
    texels, (a, b, c, d), w = texel
    word = np.uint64(k)
    four = texels[a, word], texels[b, word], texels[c, word], texels[d, word]
    return _byte(four, w, 0), _byte(four, w, 8), _byte(four, w, 16), _byte(four, w, 24)


@compiled
def _byte(words: Any, weights: Any, low: Any) -> Any:
    """Return the mean of the bytes of four words that begin at bit `low`."""
    return (
        weights[0] * np.float32(np.int32(words[0] >> low & 255))
        + weights[1] * np.float32(np.int32(words[1] >> low & 255))
        + weights[2] * np.float32(np.int32(words[2] >> low & 255))
        + weights[3] * np.float32(np.int32(words[3] >> low & 255))
    )


@compiled
def _set_up(t: Any, points: Any, moving: Any, mesh: Any, levels: Any, setup: Any, numbers: Any) -> None:
    """Write the setup of a triangle; and its number, and whether it is seen from the back."""
    triangles, fixed = mesh[0], mesh[1]
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    turn = ux * vy - vx * uy
    for k in range(PLACE):
        setup[k] = fixed[a, k]
        setup[ONE + k], setup[OTHER + k] = fixed[b, k] - fixed[a, k], fixed[c, k] - fixed[a, k]
    for k in range(VARIED - PLACE):
        at = PLACE + k
        setup[at] = moving[a, k]
        setup[ONE + at], setup[OTHER + at] = moving[b, k] - moving[a, k], moving[c, k] - moving[a, k]
    along, down, scale = _frame(setup)
    level = levels[level_of(fixed, levels, (a, b, c), turn)]
    for k in range(3):
        setup[ALONG + k], setup[DOWN + k], setup[LEVEL + k] = along[k], down[k], level[k]
    setup[SCALE], setup[CORNER], setup[CORNER + 1] = scale, points[a, 0], points[a, 1]
    setup[CHANGES], setup[CHANGES + 1] = vy / turn, vx / turn
    setup[CHANGES + 2], setup[CHANGES + 3] = uy / turn, ux / turn
    numbers[0], numbers[1] = t, turn > 0


@compiled
def _vector(values: Any, k: Any) -> Any:
    """Return three values from `k` on."""
    return values[k], values[k + 1], values[k + 2]


@compiled
def _frame(setup: Any) -> Any:
    """Return the unit vectors on a triangle along which u and v of the maps grow, and their scale, 1/m."""
    e, f = _vector(setup, ONE + PLACE), _vector(setup, OTHER + PLACE)
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
def _point(setup: Any, back: Any, x: Any, y: Any, eye: Any, shadows: Any, out: Any, i: Any) -> None:
    """Write point `i` of those that are lit together: that of a triangle at pixel (x, y).

    Args:
        back: whether its normal is turned towards the eye.
    """
    dx, dy = x - setup[CORNER], y - setup[CORNER + 1]
    s = dx * setup[CHANGES] - dy * setup[CHANGES + 1]
    r = dy * setup[CHANGES + 3] - dx * setup[CHANGES + 2]
    for k in range(VARIED):
        out[k * ROOM + i] = setup[k] + s * setup[ONE + k] + r * setup[OTHER + k]
    for k in range(VARIED, REACHED):
        out[k * ROOM + i] = setup[k]
    place, smooth = _row(out, PLACE, i), unit(_row(out, NORMAL, i))
    if back and dot(smooth, (eye[0] - place[0], eye[1] - place[1], eye[2] - place[2])) < 0:
        smooth = (-smooth[0], -smooth[1], -smooth[2])
        for k in range(3):
            out[(NORMAL + k) * ROOM + i] *= np.float32(-1)
    out[REACHED * ROOM + i] = reach(shadows, place, smooth)


@compiled
def _row(points: Any, k: Any, i: Any) -> Any:
    """Return the vector of point `i` in rows `k` to `k` + 2."""
    return points[k * ROOM + i], points[(k + 1) * ROOM + i], points[(k + 2) * ROOM + i]


@compiled
def _lit(points: Any, count: Any, surface: Any, hair: Any, coat: Any, view: Any) -> None:
    """Write the light of points of one kind, and what they mirror: its direction, share and roughness.

    Numba lights as many at a time as the processor can.
    """
    lights, eye, texels, linear = view
    one, byte, half, level = np.float32(1), np.float32(1 / 255), np.float32(0.5), np.float32(128)
    for i in range(count):
        u, v, fold = points[i], points[ROOM + i], points[FOLD * ROOM + i]
        place, smooth = _row(points, PLACE, i), unit(_row(points, NORMAL, i))
        along, down = _row(points, ALONG, i), _row(points, DOWN, i)
        towards = unit((eye[0] - place[0], eye[1] - place[1], eye[2] - place[2]))
        texel = _taps(texels, _row(points, LEVEL, i), u, v)
        su = sv = np.float32(0)
        if coat:
            thick = _mixed(texel, THICKNESS // 4)[THICKNESS % 4]
            depth = np.float32(DEPTH) * (one - thick * byte) if thick < np.float32(254) else np.float32(0)
            dive = points[SCALE * ROOM + i] * _dive(depth, smooth, towards)
            u, v = u - dive * dot(towards, along), v - dive * dot(towards, down)
            texel = _taps(texels, _row(points, LEVEL, i), u, v)
            bowl = np.float32(BOWL / IRIS[2]) * min(depth / np.float32(0.0004), one)
            su, sv = bowl * (u - np.float32(IRIS[0])), bowl * (v - np.float32(IRIS[1]))
        scale = np.float32(STEEPEST / 127)
        red, green, blue, _ = _mixed(texel, 0)
        slope_u, slope_v, open_share, roughness = _mixed(texel, 1)
        thickness, fold_u, fold_v, depth = _mixed(texel, 2)
        su += scale * (slope_u - level + (fold_u - level) * fold)
        sv += scale * (slope_v - level + (fold_v - level) * fold)
        relief = unit((
            smooth[0] - su * along[0] - sv * down[0],
            smooth[1] - su * along[1] - sv * down[1],
            smooth[2] - su * along[2] - sv * down[2],
        ))  # fmt: skip
        colour = _row(points, COLOUR, i)
        albedo = (
            linear[np.uint64(red + half)] * colour[0],
            linear[np.uint64(green + half)] * colour[1],
            linear[np.uint64(blue + half)] * colour[2],
        )
        occlusion = points[OCCLUDED * ROOM + i] * open_share * byte
        occlusion *= one - np.float32(FOLD_SHADE) * fold * depth * byte
        rough = max(points[ROUGH * ROOM + i] * roughness * byte, np.float32(0.06))
        values = occlusion, rough, thickness * byte, points[REACHED * ROOM + i]
        normals = relief, smooth, _row(points, STRAND, i)
        light, around, share = reflected(surface, hair, coat, albedo, normals, values, towards, lights)
        points[LIGHT * ROOM + i], points[(LIGHT + 1) * ROOM + i], points[(LIGHT + 2) * ROOM + i] = light
        points[MIRRORED * ROOM + i], points[(MIRRORED + 1) * ROOM + i], points[(MIRRORED + 2) * ROOM + i] = (
            around
        )
        points[SHARE * ROOM + i], points[ROUGH * ROOM + i] = share, rough


@compiled
def _add(kind: Any, count: Any, points: Any, into: Any, mesh: Any, view: Any) -> None:
    """Light points of one kind, and add their colours to the pixels of a row."""
    (lamps, levels), eye, texels = view
    columns, weights, sums = into
    surface, linear, curve = mesh[3][kind], mesh[4], mesh[5]
    full = (count + TOGETHER - 1) // TOGETHER * TOGETHER
    seen = lamps, eye, texels, linear
    if kind == HAIR:
        _lit(points, full, surface, True, False, seen)
    elif kind == EYE:
        _lit(points, full, surface, False, True, seen)
    else:
        _lit(points, full, surface, False, False, seen)
    zero, one, to_step = np.float32(0), np.float32(1), np.float32(STEPS - 1)
    for i in range(count):
        light, share = _row(points, LIGHT, i), points[SHARE * ROOM + i]
        if share > zero:
            sky = mirrored(levels, _row(points, MIRRORED, i), points[ROUGH * ROOM + i])
            light = light[0] + share * sky[0], light[1] + share * sky[1], light[2] + share * sky[2]
        for k in range(3):
            step = np.float32(math.sqrt(min(max(light[k] * np.float32(1 / BRIGHTEST), zero), one))) * to_step
            sums[columns[i], k] += weights[i] * curve[int(step)]
        sums[columns[i], 3] += weights[i]


@compiled
def light_band(
    points: Any, moving: Any, mesh: Any, texels: Any, lights: Any, eye: Any, rows: Any, pictures: Any
) -> None:
    """Write the pixels of a band of rows, and clear its samples."""
    keys, picture, room = pictures
    (found, numbers, counts, columns), (near, setups, lit, weights, sums) = room
    triangles, fixed, kinds = mesh[0], mesh[1], mesh[2]
    place, shadows = eye
    view = lights, place, texels[0]
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
                # Hairs have the normals of the head that they grow on, whichever way their card is seen.
                back = numbers[slot, 1] and kind != HAIR
                _point(setups[slot], back, px, py, place, shadows, lit[kind], i)
                columns[kind, i], weights[kind, i] = x, weight
                counts[kind] = i + 1
                if i + 1 == ROOM:
                    _add(kind, ROOM, lit[kind], (columns[kind], weights[kind], sums), mesh, view)
                    counts[kind] = 0
        for kind in range(len(counts)):
            if counts[kind]:
                into = columns[kind], weights[kind], sums
                _add(kind, counts[kind], lit[kind], into, mesh, view)
                counts[kind] = 0
        part, half = np.float32(1 / per), np.float32(0.5)
        for x in range(keys.shape[1]):
            for k in range(3):
                picture[y, x, k] = np.uint8(sums[x, k] * part + half)
            picture[y, x, 3] = np.uint8(sums[x, 3] * np.float32(255 / per) + half)
