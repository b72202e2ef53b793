"""The light that comes from what is seen in a picture: numba's version of `surface.glsl`."""

import math
from typing import Any

import numpy as np

from realizer.face.drawn_mesh import EYE, HAIR
from realizer.render.compiled import compiled
from realizer.render.lamp_view import ASIDE, NEAR, SIDE, SOFT
from realizer.render.shading import BRIGHTEST, STEPS, dot, reflected, unit
from realizer.render.surfaces import BENT, BOWL
from realizer.render.textures import CHANNELS, DEPTH, FOLD_SHADE, IRIS, STEEPEST
from realizer.render.visibility import SAMPLES, level_of


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


# Samples of one kind are lit once where their nearness differs by less than this share, and the green of
# their triangles' colours by less than that.
SAME, TINT = np.float32(8e-4), np.float32(0.05)


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
    level, kind, byte = level_of(fixed, texels[1], (a, b, c), turn), kinds[a], np.float32(1 / 255)
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
    occlusion *= np.float32(1) - np.float32(FOLD_SHADE) * fold * texel[11] * byte
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
def light_band(
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
