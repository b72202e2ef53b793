"""How light leaves a surface: the formula of all pictures, for one point at a time.

`surface.glsl` is the same formula for graphics cards. Vectors are tuples of three numbers; colours are linear
light. A lamp's colour is the light that a white surface facing it sends to the eye.

Sources: the microfacet model of Trowbridge and Reitz with Smith's shadowing, as in Heitz 2014, JCGT 3:2; its
integral over an environment by Karis 2014, "Physically based shading on mobile"; light between the walls of
cavities by Jimenez et al. 2016, "Practical realtime strategies for accurate indirect occlusion"; strands by
Kajiya and Kay 1989; normals blended per colour for skin by d'Eon and Luebke 2007, GPU Gems 3 chapter 14.
"""

import math
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.colours import srgb
from realizer.render.compiled import compiled
from realizer.render.surfaces import (
    DIRECT,
    GLINT,
    REFLECTION,
    SHADED,
    SHARP,
    SHARP_SHARE,
    SOFT,
    THIN,
    THROUGH,
    WRAP,
)  # fmt: skip

KEY, RIM = 0, 1
BRIGHTEST, STEPS = 8.0, 16384  # linear light at the end of the tone curve, and its entries


@cache
def tone_curve() -> Float32:
    """Return the sRGB byte 0..255 (STEPS,) of linear light 0..BRIGHTEST, in steps of its square root.

    The curve is the fit of Narkowicz 2015 to the reference transform of the Academy (ACES).
    """
    x = np.linspace(0, 1, STEPS) ** 2 * BRIGHTEST
    filmic = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return np.asarray(srgb(filmic.astype(np.float32)) * 255, np.float32)


@compiled
def dot(a: Any, b: Any) -> Any:
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def unit(a: Any) -> Any:
    """Return a vector at length 1; one without length stays as it is."""
    scale = np.float32(1) / np.float32(
        math.sqrt(max(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], np.float32(1e-20)))
    )
    return a[0] * scale, a[1] * scale, a[2] * scale


@compiled
def exp2(x: Any) -> Any:
    """Return 2 to the power of `x`, or of -126 if that is more, within 1 of 100,000.

    Calls of a library's function would keep the processor from shading many points at a time.
    """
    up = max(x, np.float32(-126)) + np.float32(127)
    whole = np.int32(up)
    f = up - np.float32(whole)
    root = (np.float32(0.013684) * f + np.float32(0.0517177)) * f + np.float32(0.2416213)
    root = (root * f + np.float32(0.6929696)) * f + np.float32(1.0000036)
    return root * np.int32(whole << 23).view(np.float32)


@compiled
def log2(x: Any) -> Any:
    """Return the logarithm of a number above 0, within 0.0001; of 0, about -127."""
    bits = np.float32(x).view(np.int32)
    m = np.int32(bits & 0x7FFFFF | 0x3F800000).view(np.float32)
    log = (np.float32(-0.0800109) * m + np.float32(0.6355111)) * m - np.float32(2.0994023)
    return (log * m + np.float32(4.0496168)) * m - np.float32(2.5056146) + np.float32((bits >> 23) - 127)


@compiled
def _ambient(around: Any, c: Any, n: Any) -> Any:
    """Return the light of the environment in channel `c` on a white surface with that normal."""
    x, y, z = n
    light = around[0][c] + around[1][c] * y + around[2][c] * z + around[3][c] * x
    light += (
        around[4][c] * x * y + around[5][c] * y * z + around[6][c] * (np.float32(3) * z * z - np.float32(1))
    )
    light += around[7][c] * x * z + around[8][c] * (x * x - y * y)
    return max(light, np.float32(0))


@compiled
def mirrored(levels: Any, d: Any, rough: Any) -> Any:
    """Return the light that a surface of that roughness mirrors from direction `d`.

    Levels (k, n, n, 3) are octahedral maps: forwards is the middle, backwards the corners.
    """
    one, zero, side = np.float32(1), np.float32(0), levels.shape[1]
    size = one / (abs(d[0]) + abs(d[1]) + abs(d[2]))
    u, v = d[0] * size, -d[1] * size
    if d[2] < zero:
        u, v = (one - abs(v)) * (one if u >= zero else -one), (one - abs(u)) * (one if v >= zero else -one)
    scale, most = np.float32(0.5 * side), np.float32(side - 1)
    x = min(max((u + one) * scale - np.float32(0.5), zero), most)
    y = min(max((v + one) * scale - np.float32(0.5), zero), most)
    level = min(max(rough, zero), one) * np.float32(levels.shape[0] - 1)
    k, x0, y0 = min(int(level), levels.shape[0] - 2), min(int(x), side - 2), min(int(y), side - 2)
    fx, fy, fk = x - np.float32(x0), y - np.float32(y0), level - np.float32(k)
    r = g = b = zero
    for dk in range(2):
        wk = fk if dk else one - fk
        for dy in range(2):
            wy = wk * (fy if dy else one - fy)
            j, near, far = y0 + dy, wy * (one - fx), wy * fx
            r += near * levels[k + dk, j, x0, 0] + far * levels[k + dk, j, x0 + 1, 0]
            g += near * levels[k + dk, j, x0, 1] + far * levels[k + dk, j, x0 + 1, 1]
            b += near * levels[k + dk, j, x0, 2] + far * levels[k + dk, j, x0 + 1, 2]
    return r, g, b


@compiled
def _gloss(rough: Any, nh: Any, nl: Any, nv: Any) -> Any:
    """Return the microfacet term D V of a roughness."""
    one, a = np.float32(1), rough * rough
    bend = nh * nh * (a * a - one) + one
    shade = nl * (nv * (one - a) + a) + nv * (nl * (one - a) + a)
    return np.float32(0.5 / math.pi) * a * a / (bend * bend * max(shade, np.float32(1e-4)))


@compiled
def _sine(strand: Any, normal: Any, half: Any, shift: Any) -> Any:
    """Return the squared sine to `half` of a hair whose scales tilt it by `shift` towards its root."""
    t = unit((
        strand[0] + shift * normal[0], strand[1] + shift * normal[1], strand[2] + shift * normal[2]
    ))  # fmt: skip
    th = dot(t, half)
    return max(np.float32(1) - th * th, np.float32(1e-6))


@compiled
def _scattered(c: Any, a: Any, row: Any, cosines: Any, occlusion: Any, lamps: Any) -> Any:
    """Return the light of the lamps that a surface of albedo `a` scatters in channel `c`."""
    relief, smooth, across, reached, rim, thin = cosines
    one, zero = np.float32(1), np.float32(0)
    wrap = row[WRAP + c]
    facing = max(zero, (relief + (smooth - relief) * row[SOFT + c] + wrap) / (one + wrap))
    # Strands are lit across, all around but from behind the hair.
    facing += across * (np.float32(math.sqrt(across)) * max(zero, np.float32(0.5) + smooth) - facing)
    behind = max(zero, np.float32(0.1) - smooth) * thin * np.float32(THIN[c])
    return a * (lamps[KEY][1][c] * (facing * reached * occlusion + behind) + lamps[RIM][1][c] * rim)


@compiled
def _open(a: Any, occlusion: Any) -> Any:
    """Return the share of light from around that reaches a cavity whose walls have albedo `a`."""
    low = (
        (np.float32(2.0404) * a - np.float32(0.3324)) * occlusion
        + np.float32(-4.7951) * a
        + np.float32(0.6417)
    )
    return max(occlusion, (low * occlusion + np.float32(2.7552) * a + np.float32(0.6903)) * occlusion)


@compiled
def _mirror_share(f0: Any, rough: Any, nv: Any) -> Any:
    """Return the share of the environment's light that is mirrored."""
    x = np.float32(1) - rough
    term = min(x * x, exp2(np.float32(-9.28) * nv)) * x - rough * np.float32(0.0275) + np.float32(0.0425)
    scale = np.float32(-1.04) * term - rough * np.float32(0.572) + np.float32(1.04)
    return max(
        f0 * scale + np.float32(1.04) * term + rough * np.float32(0.022) - np.float32(0.04), np.float32(0)
    )


@compiled
def _lobes(row: Any, n: Any, half: Any, view: Any, cosines: Any, rough: Any) -> Any:
    """Return the share of the key lamp's light that a surface mirrors; cosines of the lamp and of the eye."""
    nl, nv = max(cosines[0], np.float32(0)), cosines[1]
    nh, vh = max(dot(n, half), np.float32(0)), max(dot(view, half), np.float32(0))
    one, f0, share = np.float32(1), row[REFLECTION], row[SHARP_SHARE]
    miss = (one - vh) * (one - vh)
    fresnel = f0 + (one - f0) * miss * miss * (one - vh)
    lobes = (one - share) * _gloss(rough, nh, nl, nv) + share * _gloss(rough * row[SHARP], nh, nl, nv)
    return lobes * fresnel * nl * np.float32(math.pi)


@compiled
def _glint(n: Any, key: Any, view: Any, glint: Any, rough: Any) -> Any:
    """Return how bright a coat mirrors the key lamp: as a soft disc, faint if it is rough.

    Args:
        glint: the normal there is along key + glint[0] view; glint[1] is the radius in radians of normals.
    """
    place, width = glint
    g = unit((key[0] + place * view[0], key[1] + place * view[1], key[2] + place * view[2]))
    off = (n[0] - g[0], n[1] - g[1], n[2] - g[2])
    inside = (width - np.float32(math.sqrt(dot(off, off)))) / (width * np.float32(0.5))
    inside = min(max(inside, np.float32(0)), np.float32(1))
    clear = min(max(np.float32(2) - np.float32(5.5) * rough, np.float32(0.15)), np.float32(1))
    return np.float32(GLINT) * clear * inside * inside * (np.float32(3) - np.float32(2) * inside)


@compiled
def reflected(
    row: Any, hair: Any, coat: Any, albedo: Any, normals: Any, values: Any, view: Any, lights: Any
) -> Any:
    """Return the light (r, g, b) that a surface sends to the eye without that which it mirrors from around.

    That is `mirrored` from a direction, times a share: these are returned, too, as (x, y, z) and a number.

    Args:
        row: its row of `surfaces`; hair, coat: whether it is made of strands, or has a smooth coat.
        albedo: (r, g, b) linear.
        normals: of the relief, of the smooth surface, and the direction of strands; unit vectors.
        values: occlusion, roughness, thickness 0..1, and the share of the key light that is not in shadow.
        view: unit vector to the eye.
        lights: lamps (2, 2, 3): direction and colour of the key and the rim lamp; the environment's `sh`
            (9, 3); the rim lamp's power; place and width of the glint.
    """
    n, smooth, strand = normals
    occlusion, rough, thickness, reached = values
    lamps, sh, rim_power, glint = lights
    one, zero = np.float32(1), np.float32(0)
    reached += row[SHADED] * occlusion * occlusion * (one - reached)
    key, rim = lamps[KEY][0], lamps[RIM][0]
    reach = one - np.float32(DIRECT) * (one - occlusion)
    nv, nl, nl_smooth = max(dot(n, view), np.float32(1e-3)), dot(n, key), dot(smooth, key)
    edge = exp2(rim_power * log2(one - min(nv, one))) * reach
    across = zero
    if hair:
        # Cards are made of flat pieces; the strands that they show bend as evenly as the normals do.
        along = dot(strand, smooth)
        strand = unit((
            strand[0] - along * smooth[0], strand[1] - along * smooth[1], strand[2] - along * smooth[2]
        ))  # fmt: skip
        along = dot(strand, key)
        across = max(one - along * along, zero)
    cosines = (
        nl, nl_smooth, across, reached,
        max(zero, (dot(n, rim) + np.float32(0.3)) / np.float32(1.3)) * edge,
        (one - thickness) * row[THROUGH] * occlusion * occlusion,
    )  # fmt: skip
    a, b, c = albedo
    around = _ambient(sh, 0, n), _ambient(sh, 1, n), _ambient(sh, 2, n)
    red = _scattered(0, a, row, cosines, reach, lamps) + a * around[0] * _open(a, occlusion)
    green = _scattered(1, b, row, cosines, reach, lamps) + b * around[1] * _open(b, occlusion)
    blue = _scattered(2, c, row, cosines, reach, lamps) + c * around[2] * _open(c, occlusion)
    half = unit((key[0] + view[0], key[1] + view[1], key[2] + view[2]))
    power = lamps[KEY][1]
    if hair:
        lit = max(zero, np.float32(0.35) + nl_smooth) * reached * reach * (one - rough * np.float32(0.6))
        white = lit * _sine(strand, smooth, half, np.float32(-0.08)) ** 45 * np.float32(0.07)
        tinted = lit * _sine(strand, smooth, half, np.float32(0.10)) ** 11
        sheen = row[REFLECTION] * occlusion
        return (
            (
                red + (white + tinted * a) * power[0] + sheen * around[0],
                green + (white + tinted * b) * power[1] + sheen * around[1],
                blue + (white + tinted * c) * power[2] + sheen * around[2],
            ),
            n,
            zero,
        )
    if coat:
        n, nv = smooth, max(dot(smooth, view), np.float32(1e-3))
        shine = _glint(smooth, key, view, glint, rough)
    else:
        shine = _lobes(row, n, half, view, (nl, nv), rough) * reached * reach
    turn = np.float32(2) * dot(n, view)
    return (
        (red + shine * power[0], green + shine * power[1], blue + shine * power[2]),
        (turn * n[0] - view[0], turn * n[1] - view[1], turn * n[2] - view[2]),
        _mirror_share(row[REFLECTION], rough, nv) * occlusion * occlusion,
    )
