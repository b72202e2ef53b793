"""The parts of a face that is being built, and the generated eyeballs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import grid
from realizer.facebuild.submesh import Submesh


@dataclass(eq=False)
class Part:
    """A part of a face that is being built.

    Attributes:
        patch: where its vertices come from on the base mesh, or None.
        vertices: (n, 3) metres; triangles: (m, 3); colours: (n, 3) sRGB 0..255; gloss: (n,) 0..1.
        occlusion: (n,) 0..1, or None: to be baked.
        fields: row number -> (n, 3), where the part brings its own.
    """

    name: str
    patch: Submesh | None
    vertices: Float64
    triangles: Int32
    colours: Float64
    gloss: Float64
    occlusion: Float64 | None = None
    fields: dict[int, Float64] = field(default_factory=dict)

    def subset(self, index: Any, triangles: Int32) -> Part:
        """Return the part with only these of its vertices, (k,) indices, and other triangles over them."""
        patch = self.patch and Submesh(self.patch.mix[index], self.patch.offset[index], triangles)
        light = None if self.occlusion is None else self.occlusion[index]
        fields = {number: moves[index] for number, moves in self.fields.items()}
        return Part(
            self.name, patch, self.vertices[index], triangles, self.colours[index], self.gloss[index], light,
            fields,
        )  # fmt: skip


def smooth(x: Any, low: Any, high: Any) -> Any:
    """Return 0 below low, 1 above high, smooth between (Perlin's cubic); falls where high < low."""
    t = np.clip((np.asarray(x, float) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


PUPIL, IRIS = 2.05, 6.35  # mm, radii on the ball
SEGMENTS = 26


def eyeball(name: str, centre: Float64, radius: float, look: dict[str, list[float]], inward: float) -> Part:
    """Return a ball with pupil, iris, dark ring and white, finest at its pole, which looks forward.

    Args:
        radius: metres.
        look: sRGB colours: pupil, iris_inner, iris_middle, iris_outer, ring, white, corner.
        inward: +1 if the nose is at +x, -1 at -x: the white reddens there.
    """
    # Radii in mm on the flat of the eye, then angles: close together where the colour jumps.
    flat = [PUPIL - 0.05, PUPIL + 0.18, 3.0, 4.3, 5.5, 6.0, IRIS, IRIS + 0.5, 9.0]
    names = ["pupil", "iris_inner", "iris_inner", "iris_middle", "iris_outer", "ring", "ring", "white"]
    angles = [float(np.arcsin(r / 1000 / radius)) for r in flat] + [1.1, 1.55]
    turn = np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS
    points, colours = [np.array([[0, 0, 1.0]])], [np.array([look["pupil"]], float)]
    for k, angle in enumerate(angles):
        around = np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn)
        points.append(np.stack([*around, np.full(SEGMENTS, np.cos(angle))], 1))
        base = np.array(look[names[k]] if k < len(names) else look["white"], float)
        ring = np.repeat(base[None], SEGMENTS, 0)
        if k < len(names) and names[k].startswith("iris"):
            # Spokes: every iris has them, and they say which way the eye turns.
            ring *= (1 + 0.09 * np.cos(turn * 7 + k) + 0.07 * np.cos(turn * 11 + 2.0 * k))[:, None]
        if k >= len(names):
            red = smooth(points[-1][:, 0] * inward, 0.35, 0.95)[:, None] * 0.8
            red = np.maximum(red, smooth(-points[-1][:, 0] * inward, 0.55, 1.0)[:, None] * 0.5)
            ring = ring * (1 - red) + np.array(look["corner"], float) * red
        colours.append(ring)
    ball = np.concatenate(points)
    vertices = centre + radius * ball
    fan = np.stack(
        [np.zeros(SEGMENTS, int), 1 + np.arange(SEGMENTS), 1 + (np.arange(SEGMENTS) + 1) % SEGMENTS], 1
    )
    sheet = grid(len(angles), SEGMENTS, closed=True) + 1
    triangles = np.concatenate([fan, sheet]).astype(np.int32)
    part = Part(name, None, vertices, triangles, np.concatenate(colours), np.full(len(vertices), 1.0))
    # Dilation: the pupil's edge moves out, the iris gives way up to its rim.
    out = np.hypot(ball[:, 0], ball[:, 1]) * radius * 1000
    edge = flat[0]  # the outermost ring that is black
    share = np.where(out < edge + 1e-6, out / edge, np.clip((IRIS - out) / (IRIS - PUPIL - 0.2), 0, 1))
    ways = np.zeros_like(ball)
    ways[:, :2] = ball[:, :2] / np.maximum(np.hypot(ball[:, 0], ball[:, 1]), 1e-9)[:, None]
    # A unit of IRISD widens the pupil, both edges together, by that much: half at each edge.
    part.fields[29 if name == "left_eye" else 30] = ways * (share * 0.5)[:, None]
    return part
