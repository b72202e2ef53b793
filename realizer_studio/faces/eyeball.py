"""Generated eyeballs: a ball with the bulge of the cornea.

The pupil is in the centre of an eyeball's square in the maps. The distance from the centre grows with the
distance from the optical axis up to the limbus, half-way to the side, and then with the angle up to `WIDEST`.
"""

from collections.abc import Sequence

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.parts import Part

# Radii in metres. At the limbus the cornea, a smaller ball, leaves the white; the iris lies at its height.
# The cornea is flatter than people's (0.0078), because the eyeballs of the base mesh are larger.
LIMBUS, CORNEA = 0.0057, 0.0086
PUPIL = 0.0020  # radius
# Rings of vertices: distances from the axis, in radii of the limbus; of those in FAR, angles in radians.
NEAR = [0.5 * PUPIL / LIMBUS, PUPIL / LIMBUS, 0.50, 0.66, 0.80, 0.92, 1.0]
BEYOND = [1.10, 1.28, 1.60]
FAR = [0.72, 1.0, 1.45, 1.95]
SEGMENTS = 32
WIDEST = 1.15  # rad; beyond it is the socket


def cornea(radius: float) -> tuple[float, float]:
    """Return how far the cornea's centre lies before the ball's, and how much smaller its radius is, m."""
    return float(np.sqrt(radius**2 - LIMBUS**2) - np.sqrt(CORNEA**2 - LIMBUS**2)), radius - CORNEA


def eyeball(
    name: str, centre: Float64, radius: float, square: Sequence[float], dilation: int, outward: float
) -> Part:
    """Return an eyeball that looks forward, with the field of its pupil's dilation.

    Args:
        radius: of the ball, metres.
        square: left, top, right and bottom of its square in the maps, 0..1.
        dilation: number of the FAP that widens its pupil.
        outward: the side of the temple, +1 for +x, -1 for -x; it is at the right of the square in the maps.
    """
    axis_distance = np.concatenate([np.array(NEAR + BEYOND) * LIMBUS, radius * np.sin(FAR)])
    height = np.sqrt(radius**2 - axis_distance**2)
    height[len(NEAR + BEYOND) :] = radius * np.cos(FAR)
    height[: len(NEAR)] = np.sqrt(CORNEA**2 - axis_distance[: len(NEAR)] ** 2) + cornea(radius)[0]
    turn = np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS
    around = np.stack([np.cos(turn), np.sin(turn)], 1)
    rings = [
        np.column_stack([r * around, np.full(SEGMENTS, z)])
        for r, z in zip(axis_distance, height, strict=True)
    ]
    vertices = np.concatenate([[[0, 0, CORNEA + cornea(radius)[0]]], *rings])
    edge = np.arcsin(LIMBUS / radius)
    angle = np.arctan2(axis_distance, height)
    map_radius = (
        np.where(axis_distance <= LIMBUS, axis_distance / LIMBUS, 1 + (angle - edge) / (WIDEST - edge)).clip(
            0, 2
        )
        / 2
    )
    map_offset = np.concatenate([[[0, 0]], *(r * around * [outward, -1] for r in map_radius)])
    left, top, right, bottom = square
    uv = np.array([left + right, top + bottom]) / 2 + map_offset * np.array([right - left, bottom - top]) / 2
    first = np.arange(SEGMENTS)
    fan = np.stack([np.zeros(SEGMENTS, int), 1 + first, 1 + (first + 1) % SEGMENTS], 1)
    triangles = np.concatenate([fan, grid(len(axis_distance), SEGMENTS, closed=True) + 1]).astype(np.int32)
    n = len(vertices)
    part = Part(name, None, centre + vertices, triangles, np.full((n, 3), 255.0), np.zeros(n), uv=uv)
    part.fields[dilation] = _dilation(vertices, radius)
    return part


def _dilation(vertices: Float64, radius: float) -> Float64:
    """Return the field that widens a pupil by a metre along the cornea and compresses the iris."""
    axis_distance = np.hypot(vertices[:, 0], vertices[:, 1])
    share = np.minimum(axis_distance / PUPIL, np.clip((LIMBUS - axis_distance) / (LIMBUS - PUPIL), 0, 1))
    share[vertices[:, 2] < 0] = 0
    directions = np.zeros_like(vertices)
    directions[:, :2] = vertices[:, :2] / np.maximum(axis_distance, 1e-9)[:, None]
    directions[:, 2] = -axis_distance / (vertices[:, 2] - cornea(radius)[0]).clip(CORNEA / 4)
    return np.asarray(directions * (share / 2)[:, None])
