"""Hair and clothing: a scalp and a body in, cut and lifted surfaces out."""

from __future__ import annotations

import numpy as np

from realizer.arrays import Float64
from realizer.face.parts import Part, grid, smooth
from realizer.face.patch import Patch, vertex_normals

__all__: list[str] = []

# Where the hair begins, as (degrees from the front, metres above the eyes); ours, drawn on the base mesh.
HAIRLINE = (
    (0, 0.0645), (18, 0.0645), (32, 0.060), (46, 0.048), (57, 0.032), (64, 0.014), (69, -0.002), (74, -0.014),
    (80, -0.018), (95, -0.022), (110, -0.026), (124, -0.038), (136, -0.054), (150, -0.063), (180, -0.072),
)  # fmt: skip
# The hair leaves the ear free: an ellipse in the side view, (y, z) of its middle and its half axes, metres.
EAR = ((-0.018, -0.0725), (0.0320, 0.0205))
AXIS = -0.062  # z of the upright axis that the degrees are counted about


def above_hairline(at: Float64) -> Float64:
    """Metres (about) of points above the hairline; negative where the face is."""
    degrees = np.degrees(np.arctan2(np.abs(at[:, 0]), at[:, 2] - AXIS))
    x, y = np.array(HAIRLINE, float).T
    line = np.interp(degrees, x, y)
    steep = np.abs(np.interp(degrees + 2, x, y) - np.interp(degrees - 2, x, y)) / (4 * np.pi / 180 * 0.08)
    height = (at[:, 1] - line) / np.sqrt(1 + steep**2)
    (y0, z0), (tall, wide) = EAR
    # The ear leans back: its ellipse does too.
    lean = at[:, 1] - y0
    around = np.hypot(lean / tall, (at[:, 2] - z0 + 0.22 * lean) / wide)
    off_ear = np.where(np.abs(at[:, 0]) > 0.03, (around - 1) * wide, np.inf)
    return np.asarray(np.minimum(height, off_ear))


def hair(skin: Patch, base: Float64, colour: list[float], skin_colour: list[float]) -> Part:
    """Hair combed back into a bun: the scalp cut at the hairline and lifted, and a ball of hair behind."""
    at = skin.positions(base)
    near = above_hairline(at) > -0.02
    piece = skin.kept(near[skin.triangles].all(axis=1)).subdivided()[0]
    piece = piece.clipped(above_hairline(piece.positions(base)))[0]
    at = piece.positions(base)
    high = above_hairline(at)
    ups = vertex_normals(at, piece.triangles)
    crown = smooth(at[:, 1], 0.02, 0.10)
    # Fullest along the middle, close at the temples: a rounded head, not a box.
    crown = crown * np.clip(1 - (at[:, 0] / 0.075) ** 2, 0, 1)
    thick = -0.0012 + 0.0048 * smooth(high, 0, 0.010) + (0.005 + 0.013 * crown) * smooth(high, 0.004, 0.05)
    # Locks: the surface waves along the way the hair is combed.
    comb = np.arctan2(at[:, 0], at[:, 1] + 0.01)
    thick += 0.0007 * np.sin(comb * 34) * smooth(high, 0.006, 0.02)
    piece = piece.moved(ups * thick[:, None])
    tint = np.array(colour, float) * (1 + 0.20 * np.sin(comb * 34 + 1.2) + 0.12 * np.sin(comb * 77))[:, None]
    # At the line the hair is thin and the skin shows through.
    thin = 0.45 * (1 - smooth(high, 0.0, 0.006))[:, None]
    tint = tint * (1 - thin) + np.array(skin_colour, float) * 0.8 * thin
    return Part("hair", piece, piece.positions(base), piece.triangles, tint, np.full(len(piece), 0.10))


def bun(centre: Float64, radii: Float64, colour: list[float]) -> Part:
    """A ball of hair, wound around."""
    rows, columns = 12, 22
    polar = np.linspace(0.02, np.pi - 0.02, rows)[:, None]
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None]
    ball = np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), -np.cos(polar) * np.ones_like(turn)], -1
    ).reshape(-1, 3)
    wound = np.sin(np.arctan2(ball[:, 1], ball[:, 0]) * 3 + ball[:, 2] * 7)
    vertices = centre + ball * radii * (1 + 0.035 * wound)[:, None]
    tint = np.array(colour, float) * (1 + 0.22 * wound)[:, None]
    return Part("hair", None, vertices, grid(rows, columns, True), tint, np.full(len(ball), 0.10))


COLLAR = -0.182  # m; height of the collar above the plane that tilts with the neck
TILT = 0.42


def under_collar(at: Float64) -> Float64:
    """Metres of points below the neckline."""
    return np.asarray(COLLAR - (at[:, 1] + TILT * (at[:, 2] + 0.01)))


def shirt(skin: Patch, base: Float64, colour: list[float]) -> Part:
    """A shirt with a round neck: the body below the neckline, lifted off."""
    piece = skin.kept((under_collar(skin.positions(base)) > -0.03)[skin.triangles].any(axis=1))
    piece = piece.clipped(under_collar(piece.positions(base)))[0]
    at = piece.positions(base)
    low = under_collar(at)
    ups = vertex_normals(at, piece.triangles)
    thick = 0.0028 + 0.0016 * smooth(low, 0.010, 0.004)
    piece = piece.moved(ups * thick[:, None])
    tint = np.repeat(np.array([colour], float), len(piece), 0)
    tint *= (1 - 0.22 * smooth(low, 0.012, 0.009))[:, None]
    return Part("shirt", piece, piece.positions(base), piece.triangles, tint, np.zeros(len(piece)))
