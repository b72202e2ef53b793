"""Brows of single hairs that are rooted in the skin.

A hair's root lies between the corners of a triangle of the skin and goes wherever they go. The rest of the
hair is a fixed way off its root that turns with the head alone: where the skin stretches, hairs move apart
and keep their length and width.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import vertex_normals
from realizer.facebuild.hair.cards import Patch, ribbons
from realizer.facebuild.hair.skin_places import seen_from_front
from realizer.facebuild.hair.strands import unit
from realizer.facebuild.hair.texture import LEVEL
from realizer.facebuild.parts import smooth
from realizer.facebuild.person.recipe import Appearance

COUNT = 120  # cards of a brow
HALF = 0.0031  # m, half the width of its roots where it is widest
LONG, WIDE = 0.0070, 0.0015  # m, of a card
GREY = np.array([178, 174, 170.0])
# Directions of hairs in degrees from outwards to up, by the place along the brow 0 (inner end) to 1; those of
# the upper edge lean down by as much as those of the lower edge lean up.
RISE = (0.0, 0.10, 0.25, 0.5, 0.75, 1.0), (82.0, 66.0, 40.0, 18.0, 2.0, -16.0)
CROSS = 16.0
ROWS = np.array([0.0, 0.5, 1.0])
LIFT = 0.0002, 0.0006, 0.0006  # m above the skin at root, middle and tip


def brow(
    skin: tuple[Float64, Int32],
    drawn: tuple[Float64, Int32],
    points: Mapping[str, Float64],
    side: int,
    colour: Any,
    look: Appearance,
    rng: Any,
) -> Patch:
    """Return the cards of a brow.

    Args:
        skin: places (n, 3) and triangles of the skin's mesh; drawn: those that are drawn of it.
        points: feature points, metres; side: 1 left, -1 right.
        colour: sRGB of the brows.
    """
    from scipy.interpolate import PchipInterpolator

    count = round(COUNT * look.brow_cover * (0.7 + 0.3 * look.brow_thick))
    a, b, c = (points[k] for k in (("4.1", "4.3", "4.5") if side > 0 else ("4.2", "4.4", "4.6")))
    x = np.abs([a[0] - side * (0.003 - look.brow_gap), (a[0] + b[0]) / 2, b[0], c[0] - side * 0.001])
    arch = look.brow_arch
    y = np.array([a[1] + 0.0008, (a[1] + b[1]) / 2 + 0.0008 + arch / 2, b[1] - 0.0016 + arch, c[1] - 0.0012])
    middle = PchipInterpolator(x, y - look.brow_low)
    t = (np.arange(count) + rng.uniform(0, 1, count)) / count
    t = np.interp(t, (0, 0.08, 0.9, 1), (0, 0.11, 0.88, 1))  # thin at both ends
    v = rng.uniform(-1, 1, count)
    half = HALF * look.brow_thick * smooth(t, -0.30, 0.22) * (1 - 0.68 * smooth(t, 0.40, 1.0))
    across = x[0] + (x[-1] - x[0]) * t
    root = np.stack([across, middle(across) + v * half], 1)
    slope = np.degrees(np.arctan(middle.derivative()(across)))
    turn = np.interp(t, *RISE) + 0.7 * slope - CROSS * v * smooth(t, 0.05, 0.3) + rng.normal(0, 9, count)
    turn = np.radians(turn)
    long = LONG * look.brow_hair * rng.uniform(0.75, 1.2, count) * (1 - 0.35 * smooth(t, 0.6, 1.0))
    long *= 0.75 + 0.25 * smooth(t, 0.0, 0.15)
    bend = np.radians(18) * rng.uniform(0.4, 1.2, count)  # outwards and down along the hair
    first = np.stack([np.cos(turn), np.sin(turn)], 1)
    second = np.stack([np.cos(turn - bend), np.sin(turn - bend)], 1)
    flat = np.stack([root, root + first * long[:, None] / 2, root + (first + second) * long[:, None] / 2], 1)
    flat[..., 0] *= side
    corners, shares = seen_from_front(*skin, flat[:, 0])
    fine, weights = seen_from_front(*drawn, flat.reshape(-1, 2))
    ups = unit((vertex_normals(*drawn)[fine] * weights[..., None]).sum(axis=1)).reshape(count, 3, 3)
    places = (drawn[0][fine] * weights[..., None]).sum(axis=1).reshape(count, 3, 3)
    places = places + ups * np.array(LIFT)[:, None] * rng.uniform(0.6, 1.6, (count, 1, 1))
    white = look.brow_grey + 0.3 * rng.uniform(-1, 1, (count, 1)) * (1 - abs(2 * look.brow_grey - 1))
    tint = np.array(colour, float) * (1 - white) + GREY * white
    tint *= (1 + 0.18 * rng.uniform(-1, 1, (count, 1))) / LEVEL
    width = WIDE * rng.uniform(0.8, 1.2, (count, 1)) * np.array([1.0, 1.0, 0.7])
    light = np.broadcast_to(0.75 + 0.25 * ROWS, (count, 3))
    return ribbons(
        places, ups, width, ["brow"] * count, np.clip(tint, 0, 255), light, 0.0,
        (corners, np.repeat(shares[:, None], 3, axis=1)),
    )  # fmt: skip
