"""Brows: cards of hairs on the skin, and the painted colour of the hairs between the cards.

The paint closes gaps between the cards where the skin is stretched.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import flat_cross, vertex_normals
from realizer_studio.faces.hair.cards import LEVEL, Patch, ribbons
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.recipe import Appearance
from realizer_studio.faces.skin.noise import noise

CARDS = 200  # cards of a brow
HALF = 0.0031  # m, half the width of its roots where it is widest
LONG, WIDE = 0.0062, 0.0014  # m, of a card
GREY = np.array([178, 174, 170.0])
# Directions of hairs in degrees from outwards to up, by position along the brow, from 0 (inner end) to 1.
# Hairs of the upper edge lean down by `CROSS`, those of the lower edge up.
RISE = (0.0, 0.10, 0.25, 0.5, 0.75, 1.0), (64.0, 52.0, 34.0, 15.0, 0.0, -16.0)
CROSS = 16.0
ROWS = np.array([0.0, 0.5, 1.0])
LIFT = 0.0002, 0.0005, 0.0006  # m above the skin at root, middle and tip
STROKE = 0.0005, 0.006  # m, width and length of painted hairs


class Brow:
    """The line of a brow, mirrored to the left side; points (n, 2) are x and y in front view."""

    def __init__(self, points: Mapping[str, Float64], side: int, look: Appearance) -> None:
        """
        Args:
            points: feature points, metres; side: 1 left, -1 right.
        """
        a, b, c = (points[k] for k in (("4.1", "4.3", "4.5") if side > 0 else ("4.2", "4.4", "4.6")))
        x = np.abs([a[0] - side * (0.003 - look.brow_gap), (a[0] + b[0]) / 2, b[0], c[0] - side * 0.001])
        arch = look.brow_arch
        y = np.array([
            a[1] + 0.0008, (a[1] + b[1]) / 2 + 0.0008 + arch / 2, b[1] - 0.0016 + arch, c[1] - 0.0012
        ])  # fmt: skip
        self.middle = PchipInterpolator(x, y - look.brow_low)
        self.ends, self.look = (x[0], x[-1]), look

    def half(self, t: Float64) -> Float64:
        """Return half the width of the brow at its roots in metres, at positions along it, 0..1."""
        thick = HALF * self.look.brow_thick
        return np.asarray(thick * smooth(t, -0.30, 0.22) * (1 - 0.68 * smooth(t, 0.40, 1.0)))

    def turn(self, t: Float64, v: Any) -> Float64:
        """Return the directions of hairs, radians from outwards to up; v is -1 (lower edge) to 1 (upper)."""
        across = self.ends[0] + (self.ends[1] - self.ends[0]) * t
        slope = np.degrees(np.arctan(self.middle.derivative()(across)))
        return np.asarray(np.radians(np.interp(t, *RISE) + 0.7 * slope - CROSS * v * smooth(t, 0.05, 0.3)))

    def long(self, t: Float64) -> Float64:
        """Return the mean length of hairs, metres."""
        long = LONG * self.look.brow_hair * (1 - 0.35 * smooth(t, 0.6, 1.0))
        return np.asarray(long * (0.75 + 0.25 * smooth(t, 0.0, 0.15)))

    def shade(self, flat: Float64, seed: int) -> Float64:
        """Return the share of the hairs' colour in the skin, (n,) 0..1."""
        t = (flat[:, 0] - self.ends[0]) / (self.ends[1] - self.ends[0])
        inside = t.clip(0, 1)
        rise = 0.45 * self.long(inside) * np.sin(self.turn(inside, 0))
        height = flat[:, 1] - self.middle(flat[:, 0].clip(*self.ends)) - rise
        v = np.abs(height) / (self.half(inside) + np.abs(rise))
        # The coordinate across the hairs: the height above the curve that a hair from the inner end follows.
        steps = np.linspace(0, 1, 100)
        hair = np.cumsum(np.tan(self.turn(steps, 0))) * (self.ends[1] - self.ends[0]) / len(steps)
        coordinates = np.stack([height - np.interp(t, steps, hair), flat[:, 0], np.zeros_like(t)], 1)
        strokes = 0.78 + 0.22 * noise(coordinates, (*STROKE, 1.0), seed)
        body = smooth(v, 1.25, 0.35) * smooth(t, -0.05, 0.14) * smooth(t, 1.04, 0.72)
        return np.asarray(self.look.brow_cover * np.clip(body * strokes, 0, 1))


def tint_of(colour: Any, look: Appearance, white: Any = 0.0) -> Float64:
    """Return the colour of brows (..., 3), sRGB; `white` is added to the share of white hair."""
    grey = look.brow_grey + white * (1 - abs(2 * look.brow_grey - 1))
    return np.asarray(np.array(colour, float) * (1 - grey) + GREY * grey)


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
        skin: vertices (n, 3) and triangles of the skin's mesh; drawn: those of the subdivided skin.
        points: feature points, metres; side: 1 left, -1 right.
        colour: sRGB of the brows.
    """
    line = Brow(points, side, look)
    count = round(CARDS * look.brow_cover * (0.7 + 0.3 * look.brow_thick))
    t = (np.arange(count) + rng.uniform(0, 1, count)) / count
    t = np.interp(t, (0, 0.08, 0.9, 1), (0, 0.11, 0.88, 1))  # thin at both ends
    v = rng.uniform(-1, 1, count)
    across = line.ends[0] + (line.ends[1] - line.ends[0]) * t
    root = np.stack([across, line.middle(across) + v * line.half(t)], 1)
    turn = line.turn(t, v) + np.radians(rng.normal(0, 7, count))
    long = line.long(t) * rng.uniform(0.75, 1.2, count)
    bend = np.radians(18) * rng.uniform(0.4, 1.2, count)  # outwards and down along the hair
    first = np.stack([np.cos(turn), np.sin(turn)], 1)
    second = np.stack([np.cos(turn - bend), np.sin(turn - bend)], 1)
    flat = np.stack([root, root + first * long[:, None] / 2, root + (first + second) * long[:, None] / 2], 1)
    flat[..., 0] *= side
    fine, weights = project_to_front(*drawn, flat.reshape(-1, 2))
    normals = (vertex_normals(*drawn)[fine] * weights[..., None]).sum(axis=1)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).reshape(count, 3, 3)
    positions = (drawn[0][fine] * weights[..., None]).sum(axis=1).reshape(count, 3, 3)
    positions = positions + normals * np.array(LIFT)[:, None] * rng.uniform(0.6, 1.6, (count, 1, 1))
    tint = tint_of(colour, look, 0.3 * rng.uniform(-1, 1, (count, 1)))
    tint *= (1 + 0.18 * rng.uniform(-1, 1, (count, 1))) / LEVEL
    width = WIDE * rng.uniform(0.8, 1.2, (count, 1)) * np.array([1.0, 1.0, 0.7])
    light = np.broadcast_to(0.75 + 0.25 * ROWS, (count, 3))
    patch = ribbons(positions, normals, width, ["brow"] * count, np.clip(tint, 0, 255), light, 0.0)
    # A hair follows the skin below it.
    corners, shares = project_to_front(*skin, patch.positions[:, :2])
    return replace(patch, skin=corners.astype(np.int32), shares=shares)


def project_to_front(at: Float64, triangles: Int32, flat: Float64) -> tuple[Int32, Float64]:
    """Return the foremost triangle at points in front view: corners (n, 3) and barycentric weights (n, 3).

    A point outside all triangles gets the nearest one, with extrapolated weights.

    Args:
        at: (m, 3) metres; flat: (n, 2) metres.
    """
    low, high = flat.min(axis=0) - 0.01, flat.max(axis=0) + 0.01
    inside = ((at[:, :2] > low) & (at[:, :2] < high)).all(axis=1) & (at[:, 2] > -0.03)
    candidates = triangles[inside[triangles].any(axis=1)]
    a, b, c = (at[candidates[:, k], :2] for k in range(3))
    turn = flat_cross(b - a, c - a)
    candidates, a, b, c, turn = (part[turn > 1e-9] for part in (candidates, a, b, c, turn))
    points = flat[:, None]
    s = flat_cross(points - a, c - a) / turn
    t = flat_cross(b - a, points - a) / turn
    out = np.maximum(np.maximum(-s, -t), np.maximum(s + t - 1, 0))
    best = (out - 0.1 * at[candidates, 2].mean(axis=1)).argmin(axis=1)
    row = np.arange(len(flat))
    s, t = s[row, best], t[row, best]
    return candidates[best], np.stack([1 - s - t, s, t], axis=1)
