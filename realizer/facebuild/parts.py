"""Generated parts that the base mesh lacks: eyeballs and teeth."""

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


UPPER = (8.4, 6.8, 7.6, 7.0, 6.6, 9.5)  # mm: widths of the teeth of one side, from the middle
LOWER = (5.4, 5.9, 6.7, 7.0, 7.0, 10.0)
# The share of the light that reaches a tooth, from the gum at the tongue to the gum at the lips.
SHADES = (0.55, 0.78, 0.75, 1, 1, 0.8, 0.55, 0.4)
SHINES = (0.1, 0.15, 0.35, 1, 1, 1, 1, 1)  # gloss by ring
IN_LIP = 0.62  # the share of the light that reaches the lower teeth past the upper ones and the lips
WARM = np.array([1.0, 0.78, 0.64])  # the light behind the teeth comes from tongue and cheeks


def teeth(name: str, front: Float64, width: float, depth: float, colours: dict[str, list[float]]) -> Part:
    """Return an arch of twelve teeth with gums, closed towards the lips and towards the tongue.

    Args:
        front: (3,) the biting edge between the two middle teeth.
        width, depth: metres; half axes of the arch (an ellipse).
    """
    up = 1.0 if name == "upper_teeth" else -1.0
    sizes = UPPER if up > 0 else LOWER
    crown = (9.8, 8.8, 9.6, 8.0, 7.4, 6.6) if up > 0 else (8.2, 8.4, 9.0, 7.8, 7.2, 6.4)
    lift = (0.0, 0.7, 0.1, 0.6, 0.9, 1.1) if up > 0 else (0.0, 0.0, 0.0, 0.3, 0.5, 0.6)
    # Arc length along the ellipse, by small steps from the middle.
    t = np.linspace(0, np.pi * 0.62, 2000)
    x, z = width * np.sin(t), depth * (np.cos(t) - 1)
    run = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    # Gap and two ridges a tooth; the gaps stand back and are darker.
    stations: list[tuple[float, int, bool]] = []
    at = 0.0
    for k, size in enumerate(sizes):
        size /= 1000
        stations += [(at, k, True), (at + 0.18 * size, k, False), (at + 0.82 * size, k, False)]
        at += size
    stations.append((at, len(sizes) - 1, True))
    side = [(-s, k, gap) for s, k, gap in stations[:0:-1]] + stations
    rows = []
    tints = []
    white, root, gum = (np.array(colours[key], float) for key in ("tooth", "root", "gum"))
    for s, k, gap in side:
        sign = np.sign(s) or 1.0
        px, pz = sign * np.interp(abs(s), run, x), np.interp(abs(s), run, z)
        tangent = np.array(
            [np.interp(abs(s) + 1e-4, run, x) - abs(px), np.interp(abs(s) + 1e-4, run, z) - pz]
        )
        tangent /= np.hypot(*tangent)
        normal = np.array([-tangent[1] * sign, tangent[0]])  # outwards, in x and z
        back = 0.0007 if gap else 0.0
        edge = (lift[k] + (0.5 if gap else 0.0)) / 1000
        height = crown[k] / 1000
        dark = (0.72 if gap else 1.0) * (1 - 0.05 * k)
        # From the gum at the tongue over the biting edge and the front to the gum at the lips.
        for dy, dn, tint in (
            (height + 0.0030, -0.0064, gum * WARM * 0.8),
            (height * 0.80, -0.0050, root * dark * WARM),
            (edge + 0.0012, -0.0024, white * dark * (0.4 + 0.4 * WARM)),
            (edge, -0.0002, white * dark),
            (height * 0.45, 0.0004, white * dark),
            (height * 0.86 - (0.001 if gap else 0), 0.0000, root * dark),
            (height - (0.0016 if gap else 0), 0.0004, gum),
            (height + 0.0045, 0.0002, gum * 0.85),
        ):
            x_out = front[0] + px + normal[0] * (dn - back)
            rows.append([x_out, front[1] + up * dy, front[2] + pz + normal[1] * (dn - back)])
            tints.append(tint)
    vertices = np.array(rows)
    triangles = grid(len(side), len(SHADES))
    if up < 0:
        triangles = triangles[:, [0, 2, 1]]
    # Light reaches the front teeth between open lips and not the back of the mouth.
    depth_in = (front[2] - vertices[:, 2]) / depth
    near = smooth(depth_in, 0.75, 0.02)
    occlusion = 0.86 * near + 0.12
    occlusion *= np.tile(SHADES, len(side)) * (1 if up > 0 else IN_LIP)
    gloss = 0.75 * near * np.tile(SHINES, len(side))
    return Part(name, None, vertices, triangles, np.array(tints), gloss, occlusion)
