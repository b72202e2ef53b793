"""The hair of a face: a cap on the scalp, cards over it, and thin cards along the hairline."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer_studio.faces.hair.cards import LEVEL, Patch, joined, ribbons, strip_uv
from realizer_studio.faces.hair.strands import Strands, edge, grow, roots, unit
from realizer_studio.faces.hair.style import GREY, Style, colour_of
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.scalp import Scalp

BORDER, SHORTEST = 3, 0.004  # segments of cards at the hairline; m of the shortest card
FRINGE = 0.007  # m by which cards at the hairline may extend beyond it
UNDER = 0.35  # layers below that have the texture of undermost hair
CAP = 0.0011  # m; height of the cap above the skin
SOFT = 0.016  # m from the hairline over which the cap gets dense
FADE = 0.42  # the share of its texture for that
TURN, AROUND = 0.012, 0.085  # m; width of the cap's texture, and radius of the head
DEEP = 0.13  # m further in over which the rest of the texture is shown


def hair(scalp: Scalp, triangles: Int32, style: Style, colour: Any, rng: Any) -> Patch:
    """Return all cards of the hair.

    Args:
        scalp: of the subdivided skin; triangles: (m, 3) of that skin.
        colour: sRGB.
    """
    parts = [cap(scalp, triangles, style, colour)]
    if style.cards:
        parts.append(_locks(scalp, style, colour, rng))
    if style.border:
        parts.append(_border(scalp, style, colour, rng))
    if max(style.bun) > 0:
        parts.append(bun(scalp, style, lambda count: tints(style, colour, count, rng), rng))
    return joined(parts)


def tints(style: Style, colour: Any, count: int, rng: Any) -> Float64:
    """Return random colours of cards (count, 3), sRGB, with a share of grey."""
    # A card is a lock of hundreds of hairs, dark and white ones.
    white = style.grey + 0.22 * rng.uniform(-1, 1, (count, 1)) * (1 - abs(2 * style.grey - 1))
    out = np.array(colour, float) * (1 - white) + GREY * white
    out = out * (1 + style.contrast * rng.uniform(-1, 1, (count, 1)))
    return np.asarray(np.clip(out / LEVEL, 0, 255))


def cap(scalp: Scalp, triangles: Int32, style: Style, colour: Any) -> Patch:
    """Return a copy of the skin's triangles under the hair, a little above them, in the hair's colour."""
    inside = edge(scalp, style, scalp.at)
    keep = triangles[(inside[triangles] > -0.001).any(axis=1) & (inside[triangles] > -0.012).all(axis=1)]
    used, across, corners = _wrapped(scalp, keep)
    at, normals, inside = scalp.at[used], scalp.normals[used], inside[used]
    soft, full = FADE * np.maximum(inside, -0.004) / SOFT, FADE + (1 - FADE) * (inside - SOFT) / DEEP
    count = len(used)
    return Patch(
        at + normals * CAP * smooth(inside, -0.006, 0.006)[:, None],
        normals,
        strip_uv(style.cap, across, np.clip(np.where(inside < SOFT, soft, full), 0, 1)),
        np.repeat(np.clip(colour_of(style, colour) / LEVEL, 0, 255)[None], count, 0),
        style.depth * 0.5 + (1 - style.depth * 0.5) * smooth(inside, 0.022, 0.0),
        np.full(count, style.gloss * 0.5),
        corners,
        np.full((count, 3), -1, np.int32),
        np.zeros((count, 3)),
    )


def _wrapped(scalp: Scalp, triangles: Int32) -> tuple[Int32, Float64, Int32]:
    """Return the skin's vertex of each vertex (c,), its u in the texture, 0..1, and triangles (m, 3).

    The texture repeats around the head; vertices are doubled where a triangle would cross its edge.
    """
    at = scalp.at[triangles]
    turn = np.arctan2(at[..., 0], at[..., 2] - scalp.middle[2]) / (2 * np.pi)
    turn -= np.rint(turn - turn[:, :1])  # the angle wraps behind the head
    across = turn * round(2 * np.pi * AROUND / TURN)
    middle = across.mean(axis=1, keepdims=True)
    offset = across - middle
    offset *= np.minimum(1, 0.45 / np.abs(offset).max(axis=1, keepdims=True))
    low, high = -offset.min(axis=1, keepdims=True), 1 - offset.max(axis=1, keepdims=True)
    steps = np.rint((np.clip(middle % 1, low, high) + offset) * 200).astype(np.int64)
    keys, corners = np.unique(triangles * 1000 + steps, return_inverse=True)
    return keys // 1000, keys % 1000 / 200, corners.reshape(-1, 3).astype(np.int32)


def _locks(scalp: Scalp, style: Style, colour: Any, rng: Any) -> Patch:
    at = roots(scalp, style, style.cards, 0.003, 1.0, rng)
    count = len(at)
    layer = rng.permutation(np.linspace(0, 1, count) ** 0.7)
    sides, top = style.length
    length = sides + (top - sides) * smooth(unit(at - scalp.middle)[:, 1], 0.2, 0.85)
    lines = grow(scalp, style, at, layer, length * rng.uniform(0.75, 1.15, count), style.segments, rng)
    s = np.linspace(0, 1, style.segments + 1)
    shape = (0.45 + 0.75 * smooth(s, 0.0, 0.35)) * (1 - (0.75 - 0.55 * style.heavy) * smooth(s, 0.5, 1.0))
    width = style.width * rng.uniform(0.7, 1.3, (count, 1)) * shape
    light = (1 - style.depth * 0.8 * (1 - layer[:, None])) * (0.45 + 0.55 * smooth(s, 0.0, 0.35))
    names = np.where(layer < UNDER, style.under, rng.choice(style.strips, count))
    near = edge(scalp, style, at) < rng.uniform(0.004, 0.016, count)
    names = np.where(near, style.edge, names)
    return _visible_cards(lines, width, light, names, tints(style, colour, count, rng), style.gloss)


def _border(scalp: Scalp, style: Style, colour: Any, rng: Any) -> Patch:
    """Return cards of few hairs along the hairline, which soften its edge."""
    # Hanging hair lies along the hairline: beyond it, it would float on the forehead.
    low, least = (0.002, -0.002) if style.heavy else (-0.004, -FRINGE)
    at = roots(scalp, style, style.border, low, 0.008, rng)
    count = len(at)
    layer, length = rng.uniform(0.1, 0.6, count), style.border_length * rng.uniform(0.5, 1.2, count)
    lines = grow(scalp, style, at, layer, length, BORDER, rng)
    inside = edge(scalp, style, lines.positions.reshape(-1, 3)).reshape(count, -1).min(axis=1)
    lines = replace(lines, length=np.where(inside < least, 0, lines.length))
    width = 0.0048 * rng.uniform(0.7, 1.2, (count, 1)) * np.linspace(1, 0.8, BORDER + 1)
    light = np.full((count, BORDER + 1), 0.9)
    return _visible_cards(
        lines, width, light, rng.choice(style.thin, count), tints(style, colour, count, rng), style.gloss
    )


def _visible_cards(
    lines: Strands, width: Float64, light: Float64, names: Any, tint: Float64, gloss: float
) -> Patch:
    """Return cards along the lines that are not too short."""
    good = lines.length > SHORTEST
    return ribbons(
        lines.positions[good], lines.normals[good], width[good], names[good], tint[good], light[good], gloss
    )


ROWS, TURNS, RINGS = 6, 26, 7


def bun(scalp: Scalp, style: Style, tints: Callable[[int], Float64], rng: Any) -> Patch:
    """Return the cards of a bun, which wind around a flattened ball at the end of the parting."""
    pole = unit(np.array(style.parting[0], float))
    radii = np.array(style.bun, float)
    crest = scalp.skull(pole[None])[0]
    side = unit(np.cross([0, 1.0, 0], pole))
    frame = np.stack([side, np.cross(pole, side), pole])
    centre = crest + pole * radii[2] * 0.72
    positions, normals, widths, lights = [], [], [], []
    s = np.linspace(0, 1, ROWS + 1)
    for ring in range(RINGS):
        polar = np.pi * (0.10 + 0.78 * (ring + 0.5) / RINGS)
        count = max(4, round(TURNS * np.sin(polar) / 2))
        for k in range(count):
            turn = 2 * np.pi * ((k + rng.uniform(0, 1)) / count) + s * rng.uniform(1.3, 1.9)
            lean = polar + (s - 0.5) * rng.uniform(-0.35, 0.75)
            lock = 1 + 0.06 * rng.uniform(-1, 1) + 0.07 * np.sin(np.pi * s) - 0.05
            ball = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], 1)
            positions.append(centre + (ball * radii * lock[:, None]) @ frame)
            normals.append(unit((ball / radii) @ frame))
            widths.append(radii[0] * 0.42 * rng.uniform(0.7, 1.2) * (0.6 + 0.4 * np.sin(np.pi * s)))
            lights.append((0.55 + 0.45 * np.sin(np.pi * s)) * rng.uniform(0.7, 1.0))
    number = len(positions)
    return ribbons(
        np.array(positions), np.array(normals), np.array(widths), ["dense"] * number, tints(number),
        np.array(lights), style.gloss,
    )  # fmt: skip
