"""Generated eyeballs: a ball with the bulge of the cornea, which has its own place in the maps.

The pupil is in the middle of their square in the maps. The distance from it grows with the distance from the
optical axis up to the limbus, half-way to the side, and from there with the angle up to `WIDEST`.
"""

from collections.abc import Sequence

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.parts import Part

# Metres. The limbus is where the cornea, a smaller ball, comes out of the white; the iris lies at its height.
# The cornea is a little flatter than people's (0.0078), because the eyeballs of the base mesh are larger.
LIMBUS, CORNEA = 0.0057, 0.0086
PUPIL = 0.0020  # radius
# Distances of rings of vertices from the axis, in radii of the limbus; of the last ones angles in radians.
NEAR = [0.5 * PUPIL / LIMBUS, PUPIL / LIMBUS, 0.50, 0.66, 0.80, 0.92, 1.0]
BEYOND = [1.10, 1.28, 1.60]
FAR = [0.72, 1.0, 1.45, 1.95]
SEGMENTS = 32
WIDEST = 1.15  # rad; beyond it is the socket


def cornea(radius: float) -> tuple[float, float]:
    """Return how far the cornea's centre lies before that of a ball, and how much smaller it is, metres."""
    return float(np.sqrt(radius**2 - LIMBUS**2) - np.sqrt(CORNEA**2 - LIMBUS**2)), radius - CORNEA


def eyeball(
    name: str, centre: Float64, radius: float, square: Sequence[float], dilation: int, outward: float
) -> Part:
    """Return an eyeball that looks forward, and how its pupil grows.

    Args:
        radius: of the ball, metres.
        square: left, top, right and bottom of its square in the maps, 0..1.
        dilation: number of the FAP that widens its pupil.
        outward: +1 if the temple is at +x, -1 at -x: there the maps' right side is.
    """
    out = np.concatenate([np.array(NEAR + BEYOND) * LIMBUS, radius * np.sin(FAR)])
    height = np.sqrt(radius**2 - out**2)
    height[len(NEAR + BEYOND) :] = radius * np.cos(FAR)
    height[: len(NEAR)] = np.sqrt(CORNEA**2 - out[: len(NEAR)] ** 2) + cornea(radius)[0]
    turn = np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS
    around = np.stack([np.cos(turn), np.sin(turn)], 1)
    rings = [np.column_stack([r * around, np.full(SEGMENTS, z)]) for r, z in zip(out, height, strict=True)]
    vertices = np.concatenate([[[0, 0, CORNEA + cornea(radius)[0]]], *rings])
    edge = np.arcsin(LIMBUS / radius)
    angle = np.arctan2(out, height)
    place = np.where(out <= LIMBUS, out / LIMBUS, 1 + (angle - edge) / (WIDEST - edge)).clip(0, 2) / 2
    flat = np.concatenate([[[0, 0]], *(r * around * [outward, -1] for r in place)])
    left, top, right, bottom = square
    uv = np.array([left + right, top + bottom]) / 2 + flat * np.array([right - left, bottom - top]) / 2
    first = np.arange(SEGMENTS)
    fan = np.stack([np.zeros(SEGMENTS, int), 1 + first, 1 + (first + 1) % SEGMENTS], 1)
    triangles = np.concatenate([fan, grid(len(out), SEGMENTS, closed=True) + 1]).astype(np.int32)
    n = len(vertices)
    part = Part(name, None, centre + vertices, triangles, np.full((n, 3), 255.0), np.zeros(n), uv=uv)
    part.fields[dilation] = _dilation(vertices, radius)
    return part


def _dilation(vertices: Float64, radius: float) -> Float64:
    """Return the row of a pupil that grows by a metre in diameter, along the cornea; the iris gives way."""
    out = np.hypot(vertices[:, 0], vertices[:, 1])
    share = np.minimum(out / PUPIL, np.clip((LIMBUS - out) / (LIMBUS - PUPIL), 0, 1))
    share[vertices[:, 2] < 0] = 0
    ways = np.zeros_like(vertices)
    ways[:, :2] = vertices[:, :2] / np.maximum(out, 1e-9)[:, None]
    ways[:, 2] = -out / (vertices[:, 2] - cornea(radius)[0]).clip(CORNEA / 4)
    return np.asarray(ways * (share / 2)[:, None])
