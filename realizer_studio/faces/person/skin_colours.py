"""Skin colours and baked ambient occlusion."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.makehuman import Figure
from realizer_studio.faces.person.recipe import Appearance


def paint_skin(
    figure: Figure, lips: Lips, rings: list[list[list[int]]], colours: Mapping[str, Any], look: Appearance
) -> Float64:
    """Return the broad colours of the body, (n, 3) sRGB 0..255; details are in the maps.

    Args:
        rings: the rings around the openings of the left and right eye, from the edge outwards.
        colours: sRGB colours skin, blush, mouth.
    """
    at, n = figure.at, len(figure.at)
    skin, blush, mouth = (np.array(colours[k], float) for k in ("skin", "blush", "mouth"))
    out = np.repeat(skin[None], n, 0)

    def glow(name: str, radii: Any, amount: float, colour: Any = blush, offset: Any = 0.0) -> None:
        nonlocal out
        share = (figure.ellipsoid(figure.point(name) + np.asarray(offset), radii) * min(amount, 1))[:, None]
        out = out * (1 - share) + colour * share

    flush, dark = look.flush, 1 + look.age
    for left, right, radii, amount in (
        ("5.1", "5.2", (0.032, 0.030, 0.05), 0.30), ("5.3", "5.4", (0.030, 0.022, 0.05), 0.34),
        ("9.3", "9.3", (0.020, 0.018, 0.03), 0.26), ("2.10", "2.10", (0.020, 0.016, 0.03), 0.12),
        ("9.1", "9.2", (0.014, 0.014, 0.02), 0.34),
        ("10.1", "10.2", (0.02, 0.025, 0.03), 0.45), ("10.3", "10.4", (0.02, 0.025, 0.03), 0.45),
        ("10.5", "10.6", (0.02, 0.025, 0.03), 0.45),
    ):  # fmt: skip
        for name in (left, right):
            glow(name, radii, amount * flush)
    # A darker, greyer half-moon under the eyes, and dark sockets towards the nose.
    for name in ("3.9", "3.10"):
        glow(name, (0.018, 0.010, 0.03), 0.20 * dark, skin * [0.86, 0.80, 0.82])
    for name in ("3.13", "3.14"):
        glow(name, (0.019, 0.008, 0.03), 0.32 * dark, skin * [0.84, 0.74, 0.70], [0, -0.001, 0])
    for name in ("3.11", "3.8"):
        glow(name, (0.010, 0.012, 0.03), 0.30 * dark, skin * [0.80, 0.70, 0.68], [0, 0.004, 0])
    inside = lips.inside
    out[inside] = mouth * np.clip(lips.fade[inside], 0.55, 1)[:, None]
    for ring in rings:
        # The wet edge of the lids is pink; the roots of lashes darken the upper one.
        top = at[ring[0]][:, 1] > np.median(at[ring[0]][:, 1])
        for k, (upper, lower) in enumerate(((0.62, 0.30), (0.60, 0.20), (0.16, 0.06))):
            share = np.where(top, upper, lower)[:, None]
            out[ring[k]] = (
                out[ring[k]] * (1 - share) + np.where(top[:, None], [92, 58, 48.0], [205, 120, 110.0]) * share
            )
    return np.asarray(np.clip(out, 0, 255))


def beard(figure: Figure, lips: Lips) -> Float64:
    """Return the weight of a beard, (n,): 1 on upper lip, chin and jaw, up to the ears."""
    at = figure.at
    under_nose, corner, lobe, chin = (figure.point(k) for k in ("9.15", "8.3", "10.7", "2.1"))
    lateral = np.abs(at[:, 0])
    line = np.interp(
        lateral,
        [0, 0.016, corner[0] + 0.006, 0.75 * lobe[0], lobe[0]],
        [under_nose[1] + 0.004, under_nose[1] + 0.002, corner[1] + 0.006, corner[1] + 0.018, lobe[1] + 0.045],
    )
    # The beard ends a little below the jaw, and is nearer to the lower lip than to the upper one.
    low = np.interp(at[:, 2], [lobe[2], chin[2] - 0.030], [lobe[1] - 0.034, chin[1] - 0.026])
    face = smooth(at[:, 1] - line, 0.004, -0.008) * smooth(at[:, 1] - low, -0.012, 0.010)
    before = smooth(at[:, 2] - lobe[2], -0.002, 0.012)
    bare = np.where(lips.is_upper, lips.lips, smooth(lips.distance, 0.006, 0.001))
    return np.asarray(face * before * (1 - bare) * figure.body)


# Metres behind the lips where the mouth's lining is darkest; light there, and right behind the lips.
DEEP, LIT = 0.060, (0.55, 0.85)


def lining(colours: Mapping[str, Any], deep: Any) -> Any:
    """Return the colour (n, 3) of the mouth's lining, which darkens from the lips to the back.

    Args:
        colours: sRGB colours mouth, tongue; deep: (n,) metres behind the lips.
    """
    near = 1 - smooth(deep, 0.0, DEEP)[:, None]
    back, front = np.array(colours["mouth"], float), np.array(colours["tongue"], float) * 0.9
    return back + (front - back) * near


def light_mouth(light: Float64, share: Float64, deep: Float64) -> None:
    """Set the light on the lining of the mouth, in place, to that of an open mouth.

    The baked occlusion is that of closed lips, behind which there is no light.

    Args:
        light: (n,) 0..1; share: (n,) 1 on the lining, 0 elsewhere; deep: (n,) metres behind the lips.
    """
    light += share * (np.interp(1 - smooth(deep, 0.0, DEEP), (0, 1), LIT) - light)


DIRECTIONS, CELL, BIAS = 192, 0.0013, 0.0026  # rays a vertex; metres of a depth cell; metres a ray starts off


def occlusion(
    vertices: Float64, normals: Float64, blockers: Int32, directions: int = DIRECTIONS, cell: float = CELL
) -> Float64:
    """Return the ambient occlusion of each vertex: the visible share of the sky, 0..1, cosine-weighted.

    It is computed from depth images of many directions: a vertex that lies deeper than the image is in
    shadow from that direction.

    Args:
        vertices, normals: (n, 3).
        blockers: (m, 3) triangles that cast shadows.
        directions, cell: the number of images, and metres of their cells.
    """
    cloud = _cover(vertices, blockers, cell)
    bias = cell * BIAS / CELL
    # A spiral of evenly spread directions (Fibonacci).
    k = np.arange(directions) + 0.5
    height, angle = 1 - 2 * k / directions, np.pi * (1 + 5**0.5) * k
    rays = np.stack(
        [np.sqrt(1 - height**2) * np.cos(angle), height, np.sqrt(1 - height**2) * np.sin(angle)], 1
    )
    visible, total = np.zeros(len(vertices)), np.zeros(len(vertices))
    for ray in rays:
        side = np.cross(ray, [0, 0, 1] if abs(ray[2]) < 0.9 else [0, 1, 0])
        side /= np.linalg.norm(side)
        frame = np.stack([side, np.cross(ray, side), ray], 1)
        facing = np.maximum(normals @ ray, 0)
        lit = facing > 0.02
        rotated, samples = cloud @ frame, (vertices + normals * 0.0008)[lit] @ frame
        low = rotated[:, :2].min(axis=0) - cell
        shape = np.ceil((rotated[:, :2].max(axis=0) - low) / cell).astype(int) + 2
        cells = ((rotated[:, :2] - low) / cell).astype(int)
        depth = np.full(shape[0] * shape[1], -np.inf)
        np.maximum.at(depth, cells[:, 0] * shape[1] + cells[:, 1], rotated[:, 2])
        sample_cells = np.clip(((samples[:, :2] - low) / cell).astype(int), 0, shape - 1)
        free = samples[:, 2] + bias > depth[sample_cells[:, 0] * shape[1] + sample_cells[:, 1]]
        visible[lit] += facing[lit] * free
        total += facing
    return np.asarray(np.where(total > 0, visible / np.maximum(total, 1e-9), 1))


def _cover(vertices: Float64, triangles: Int32, cell: float) -> Float64:
    """Return points on the triangles, closer together than a depth cell."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    longest = np.max(
        [np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)], axis=0
    )
    steps = np.clip(np.ceil(longest / (cell * 0.8)).astype(int), 1, 24)
    points = [vertices]
    for n in np.unique(steps):
        chosen = steps == n
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        inside = i + j <= n
        u, v = i[inside] / n, j[inside] / n
        w = 1 - u - v
        spread = a[chosen, None] * w[:, None] + b[chosen, None] * u[:, None] + c[chosen, None] * v[:, None]
        points.append(spread.reshape(-1, 3))
    return np.concatenate(points)
