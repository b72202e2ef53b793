"""Coordinates around the mouth (along, across, above and below), and the joint of the jaw."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import edge_graph, half_edges, neighbour_mean
from realizer_studio.faces.mpeg4.zones import Triple
from realizer_studio.faces.person.lips import spline_basis

# The contours from the right corner over the middle to the left corner: upper, then lower.
INNER = (("2.5", "2.7", "2.2", "2.6", "2.4"), ("2.5", "2.9", "2.3", "2.8", "2.4"))
OUTER = (("8.4", "8.6", "8.1", "8.5", "8.3"), ("8.4", "8.8", "8.2", "8.7", "8.3"))
STEPS = 12  # samples of a segment of a contour
LIPS = 0.004  # m around the lips where the border between upper and lower skin is sharp
BLUR = 12  # smoothing passes of that border elsewhere


@dataclass(frozen=True, eq=False)
class Mouth:
    """The position of each vertex of the skin relative to the lips."""

    # (5, n) weights of the stations along the lips, from the right corner to the left; they sum to 1.
    knots: Float64
    outer: Float64  # (n,) 0 on the inner contour and in the mouth, 1 on the outer contour and beyond
    upper: Float64  # (n,) 1 above the slit, 0 below
    distance: Float64  # (n,) metres over the skin to the lips' contours
    # (n,) position along the lips, from -1 at the right corner to 1 at the left; extrapolated beyond.
    along: Float64


def mouth_of(skin: Float64, triangles: Int32, points: Mapping[str, Triple], upper: Int32) -> Mouth:
    """Return the coordinates of the skin's vertices.

    Args:
        skin: (n, 3) metres; triangles: (m, 3) of the skin; upper: vertices above the slit.
    """
    positions = {name: np.array(value, float) for name, value in points.items()}
    graph = edge_graph(skin, half_edges(triangles))
    inner, from_inner = _surface_distance(graph, skin, positions, INNER)
    outer, from_outer = _surface_distance(graph, skin, positions, OUTER)
    # Across the lip the coordinate rises from 0 to 1 between the contours, whatever the lip's width.
    width = np.maximum(np.maximum(inner[from_outer], outer[from_inner]), 1e-4)
    across = np.clip((inner - outer + width) / (2 * width), 0, 1)
    along = (1 - across) * _along(skin, positions, INNER) + across * _along(skin, positions, OUTER)
    above = np.zeros(len(skin))
    above[upper] = 1
    distance = np.minimum(inner, outer)
    soft = above
    mean = neighbour_mean(len(skin), half_edges(triangles))
    for _ in range(BLUR):
        soft = np.asarray(mean @ soft)
    return Mouth(spline_basis(along), across, np.where(distance < LIPS, above, soft), distance, along)


def _surface_distance(
    graph: Any, at: Float64, positions: Mapping[str, Float64], contours: Any
) -> tuple[Float64, Int32]:
    """Return the distance (n,) over the skin to the contours in metres, and their nearest vertex."""
    t = np.linspace(0, 1, STEPS)[:, None]
    line = np.concatenate(
        [positions[a] * (1 - t) + positions[b] * t for contour in contours for a, b in pairwise(contour)]
    )
    sources = np.unique(np.asarray(cKDTree(at).query(line)[1]))
    distance, _, nearest = dijkstra(
        graph, directed=False, indices=sources, min_only=True, return_predecessors=True
    )
    distance = np.where(np.isfinite(distance), distance, 1.0)
    return np.asarray(distance, np.float64), np.where(nearest >= 0, nearest, sources[0]).astype(np.int32)


def _along(at: Float64, positions: Mapping[str, Float64], contours: Any) -> Float64:
    """Return the position along the lips, (n,): -1, -0.5, 0, 0.5 and 1 at the contours' five points."""
    x = np.mean([[positions[name][0] for name in contour] for contour in contours], axis=0)
    return np.asarray(np.interp(at[:, 0], x, [-1, -0.5, 0, 0.5, 1]))


STRONG = 0.7  # of the largest displacement, above which skin moves with the bone
FAR = 0.7  # eye distances; the largest plausible distance of a joint from the default


def joint_of(at: Float64, move: Float64, default: Float64, eyes: float) -> tuple[Float64, bool]:
    """Return the axis of the jaw (3,) in metres, fitted to the vertices that a jaw-opening shape moves most.

    A rotation about +x by a moves y and z by A (p - c), A = [[cos a - 1, -sin a], [sin a, cos a - 1]]. Least
    squares find the two numbers of A and the shift.

    Args:
        at: (n, 3) metres; move: (n, 3), the jaw's opening.
        default: (3,) the joint by proportions; eyes: metres between the eyes.

    Returns:
        The joint, and whether it was found from the shape; if not, it is `default`.
    """
    size = np.linalg.norm(move, axis=1)
    if size.max() < 1e-6:
        return default, False
    strong = size > STRONG * size.max()
    y, z = at[strong, 1], at[strong, 2]
    one, none = np.ones_like(y), np.zeros_like(y)
    rows = np.concatenate(
        [np.stack([y, -z, one, none], 1), np.stack([z, y, none, one], 1)]
    )  # unknown: cos a - 1, sin a, shift of y, shift of z
    (c, s, dy, dz), *_ = np.linalg.lstsq(rows, np.concatenate([move[strong, 1], move[strong, 2]]), rcond=None)
    turn = np.array([[c, -s], [s, c]])
    if abs(np.linalg.det(turn)) < 1e-6:
        return default, False
    joint = np.array([default[0], *np.linalg.solve(turn, [-dy, -dz])])
    plausible = bool(s > 0 and np.linalg.norm(joint - default) < FAR * eyes)
    return (joint, True) if plausible else (default, False)


def drag_of(at: Float64, move: Float64, pivot: Float64, chin: int) -> Float64:
    """Return the share of the jaw's rotation for each vertex in a jaw-opening shape, (n,) 0..1.

    Args:
        move: (n, 3), the opening; chin: the vertex with share 1.
    """
    arm = at - pivot
    angle = float(np.linalg.norm(move[chin, 1:]) / max(float(np.linalg.norm(arm[chin, 1:])), 1e-9))
    turned = np.zeros_like(arm)
    turned[:, 1] = arm[:, 1] * (np.cos(angle) - 1) - arm[:, 2] * np.sin(angle)
    turned[:, 2] = arm[:, 1] * np.sin(angle) + arm[:, 2] * (np.cos(angle) - 1)
    share = (move * turned).sum(axis=1) / np.maximum((turned**2).sum(axis=1), 1e-12)
    share = share / max(float(share[chin]), 1e-6)
    return np.asarray(np.clip(share, 0, 1))
