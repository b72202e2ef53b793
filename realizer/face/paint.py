"""Skin colours and baked ambient occlusion: places in, sRGB and light out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from realizer.arrays import Float64, Int32
from realizer.face.ground import Ground
from realizer.face.lips import Lips
from realizer.face.parts import smooth

__all__: list[str] = []


def texture(data: Path, name: str, uv: Float64) -> Float64:
    """A texture's brightness 0..1 at texture coordinates (n, 2)."""
    from PIL import Image

    with Image.open(data / "mpfb2/textures" / name) as image:
        pixels = np.asarray(image.convert("L"), float) / 255
    height, width = pixels.shape
    rows = np.clip(((1 - uv[:, 1]) * (height - 1)).round().astype(int), 0, height - 1)
    columns = np.clip((uv[:, 0] * (width - 1)).round().astype(int), 0, width - 1)
    return np.asarray(pixels[rows, columns])


def paint_skin(
    ground: Ground, lips: Lips, rings: list[list[list[int]]], look: dict[str, Any]
) -> tuple[Float64, Float64]:
    """Colours (n, 3) sRGB 0..255 and gloss (n,) of the base mesh's body.

    Args:
        rings: left and right eye's rings around the opening, from the edge outwards.
        look: sRGB colours skin, lips, blush, mouth.
    """
    at, n = ground.at, len(ground.at)
    skin, red, blush, mouth = (np.array(look[k], float) for k in ("skin", "lips", "blush", "mouth"))
    out = np.repeat(skin[None], n, 0)
    gloss = np.full(n, 0.16)

    def glow(name: str, radii: Any, amount: float) -> None:
        nonlocal out
        share = (ground.ellipsoid(ground.point(name), radii) * amount)[:, None]
        out = out * (1 - share) + blush * share

    for name in ("5.1", "5.2"):
        glow(name, (0.032, 0.030, 0.05), 0.30)
    for name in ("5.3", "5.4"):
        glow(name, (0.030, 0.022, 0.05), 0.30)
    glow("9.3", (0.020, 0.018, 0.03), 0.42)
    glow("2.10", (0.020, 0.016, 0.03), 0.22)
    for name in ("10.1", "10.2", "10.5", "10.6", "10.3", "10.4"):
        glow(name, (0.02, 0.025, 0.03), 0.35)
    # A greyer, darker half-moon under the eyes and a brow bone that is a little lighter.
    for name in ("3.9", "3.10"):
        share = ground.ellipsoid(ground.point(name), (0.018, 0.010, 0.03))[:, None] * 0.20
        out = out * (1 - share) + (skin * [0.86, 0.80, 0.82]) * share
    for name in ("3.13", "3.14"):
        share = (
            ground.ellipsoid(ground.point(name) + np.array([0, -0.001, 0]), (0.019, 0.008, 0.03))[:, None]
            * 0.30
        )
        out = out * (1 - share) + (skin * [0.84, 0.74, 0.70]) * share
    # Red of the lips: whole from ring 1 to ring 6, half at its border, darker where they meet.
    amount = np.zeros(n)
    for k, part in enumerate((1, 1, 1, 1, 1, 1, 0.95, 0.45, 0.06)):
        amount[lips.rings[k]] = part
    amount *= 1 - 0.45 * smooth(np.abs(lips.u), 0.86, 1.0)
    out = out * (1 - amount[:, None]) + red * amount[:, None]
    gloss += amount * 0.30
    for k, dark in ((0, 0.55), (1, 0.70), (2, 0.90)):
        out[lips.rings[k]] *= dark
    inside = lips.inside
    # Wet near the lips, dark and dull behind: a shine deep in the mouth looks like metal.
    out[inside] = mouth * np.clip(lips.fade[inside], 0.55, 1)[:, None]
    gloss[inside] = 0.3 * np.clip(lips.fade[inside] * 2 - 1, 0, 1)
    for ring in rings:
        # The wet edge of the lids is pink, the upper one darkened by the lashes' roots.
        top = at[ring[0]][:, 1] > np.median(at[ring[0]][:, 1])
        for k, (upper, lower) in enumerate(((0.55, 0.25), (0.62, 0.18), (0.22, 0.06))):
            share = np.where(top, upper, lower)[:, None]
            out[ring[k]] = (
                out[ring[k]] * (1 - share) + np.where(top[:, None], [92, 58, 48.0], [205, 120, 110.0]) * share
            )
        gloss[ring[0]] = 0.5
    nose = ground.ellipsoid(ground.point("9.3"), (0.014, 0.016, 0.02))
    gloss += 0.16 * nose
    return np.clip(out, 0, 255), np.clip(gloss, 0, 1)


DIRECTIONS, CELL, BIAS = 192, 0.0013, 0.0026  # rays a vertex; metres of a depth cell; metres a ray starts off


def occlusion(
    vertices: Float64, normals: Float64, triangles: Int32, blockers: Int32 | None = None,
    directions: int = DIRECTIONS, cell: float = CELL,
) -> Float64:  # fmt: skip
    """How much of the sky above it each vertex sees, 0..1, weighted by the cosine.

    Depth pictures of the mesh from many directions take the place of rays: a vertex that lies deeper than
    what the picture shows at its place is in shadow from there.

    Args:
        vertices, normals: (n, 3).
        blockers: triangles that cast shadows; all if None.
        directions, cell: how many pictures, and metres of their cells: fewer and larger ones are quicker.
    """
    cloud = _cover(vertices, triangles if blockers is None else blockers, cell)
    bias = cell * BIAS / CELL
    # A spiral of evenly spread directions (Fibonacci).
    k = np.arange(directions) + 0.5
    height, turn = 1 - 2 * k / directions, np.pi * (1 + 5**0.5) * k
    ways = np.stack([np.sqrt(1 - height**2) * np.cos(turn), height, np.sqrt(1 - height**2) * np.sin(turn)], 1)
    seen, total = np.zeros(len(vertices)), np.zeros(len(vertices))
    for way in ways:
        side = np.cross(way, [0, 0, 1] if abs(way[2]) < 0.9 else [0, 1, 0])
        side /= np.linalg.norm(side)
        frame = np.stack([side, np.cross(way, side), way], 1)
        facing = np.maximum(normals @ way, 0)
        lit = facing > 0.02
        far, here = cloud @ frame, (vertices + normals * 0.0008)[lit] @ frame
        low = far[:, :2].min(axis=0) - cell
        shape = np.ceil((far[:, :2].max(axis=0) - low) / cell).astype(int) + 2
        cells = ((far[:, :2] - low) / cell).astype(int)
        depth = np.full(shape[0] * shape[1], -np.inf)
        np.maximum.at(depth, cells[:, 0] * shape[1] + cells[:, 1], far[:, 2])
        mine = np.clip(((here[:, :2] - low) / cell).astype(int), 0, shape - 1)
        free = here[:, 2] + bias > depth[mine[:, 0] * shape[1] + mine[:, 1]]
        seen[lit] += facing[lit] * free
        total += facing
    return np.asarray(np.where(total > 0, seen / np.maximum(total, 1e-9), 1))


def _cover(vertices: Float64, triangles: Int32, cell: float) -> Float64:
    """Points on the triangles, closer together than a depth cell."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    longest = np.max(
        [np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)], axis=0
    )
    steps = np.clip(np.ceil(longest / (cell * 0.8)).astype(int), 1, 24)
    points = [vertices]
    for n in np.unique(steps):
        mine = steps == n
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        inside = i + j <= n
        u, v = i[inside] / n, j[inside] / n
        w = 1 - u - v
        points.append(
            (a[mine, None] * w[:, None] + b[mine, None] * u[:, None] + c[mine, None] * v[:, None]).reshape(
                -1, 3
            )
        )
    return np.concatenate(points)
