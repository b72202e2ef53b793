"""Coordinates around the mouth (along, across, above and below), and the joint of the jaw."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import edge_graph, half_edges, neighbour_mean
from realizer_studio.faces.mpeg4.zones import Triple
from realizer_studio.faces.person.lips import spline_basis

# The contours from the right corner over the middle to the left corner: upper, then lower.
INNER = (("2.5", "2.7", "2.2", "2.6", "2.4"), ("2.5", "2.9", "2.3", "2.8", "2.4"))
OUTER = (("8.4", "8.6", "8.1", "8.5", "8.3"), ("8.4", "8.8", "8.2", "8.7", "8.3"))
STEPS = 12  # places a stretch of contour is looked at in
LIPS = 0.004  # m about the lips where above and below stay sharp
BLUR = 12  # times; elsewhere the border between above and below is soft


@dataclass(frozen=True, eq=False)
class Mouth:
    """The position of each vertex of the skin relative to the lips."""

    # (5, n) how much each station along the lips has to say, right corner to left; they add to 1.
    knots: Float64
    outer: Float64  # (n,) 0 on the inner contour and in the mouth, 1 on the outer one and beyond
    upper: Float64  # (n,) 1 above the slit, 0 below
    away: Float64  # (n,) metres over the skin to the lips' contours
    # (n,) -1 at the right corner .. 1 at the left, and so beyond.
    along: Float64


def mouth_of(skin: Float64, triangles: Int32, points: Mapping[str, Triple], upper: Int32) -> Mouth:
    """Return the coordinates of the skin's vertices.

    Args:
        skin: (n, 3) metres; triangles: (m, 3) of the skin; upper: vertices above the slit.
    """
    place = {name: np.array(value, float) for name, value in points.items()}
    graph = edge_graph(skin, half_edges(triangles))
    inner, from_inner = _ways(graph, skin, place, INNER)
    outer, from_outer = _ways(graph, skin, place, OUTER)
    # Between the contours it rises from 0 to 1, whatever the lip's width; beyond them it stays.
    width = np.maximum(np.maximum(inner[from_outer], outer[from_inner]), 1e-4)
    across = np.clip((inner - outer + width) / (2 * width), 0, 1)
    along = (1 - across) * _along(skin, place, INNER) + across * _along(skin, place, OUTER)
    above = np.zeros(len(skin))
    above[upper] = 1
    away = np.minimum(inner, outer)
    soft = above
    mean = neighbour_mean(len(skin), half_edges(triangles))
    for _ in range(BLUR):
        soft = np.asarray(mean @ soft)
    return Mouth(spline_basis(along), across, np.where(away < LIPS, above, soft), away, along)


def _ways(graph: Any, at: Float64, place: Mapping[str, Float64], contours: Any) -> tuple[Float64, Int32]:
    """Return the distance (n,) over the skin to the contours in metres, and their nearest vertex."""
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree

    t = np.linspace(0, 1, STEPS)[:, None]
    line = np.concatenate(
        [place[a] * (1 - t) + place[b] * t for contour in contours for a, b in pairwise(contour)]
    )
    sources = np.unique(np.asarray(cKDTree(at).query(line)[1]))
    away, _, nearest = dijkstra(
        graph, directed=False, indices=sources, min_only=True, return_predecessors=True
    )
    away = np.where(np.isfinite(away), away, 1.0)
    return np.asarray(away, np.float64), np.where(nearest >= 0, nearest, sources[0]).astype(np.int32)


def _along(at: Float64, place: Mapping[str, Float64], contours: Any) -> Float64:
    """Return the place along the lips, (n,): -1, -0.5, 0, 0.5 and 1 at the contours' five points."""
    x = np.mean([[place[name][0] for name in contour] for contour in contours], axis=0)
    return np.asarray(np.interp(at[:, 0], x, [-1, -0.5, 0, 0.5, 1]))


STRONG = 0.7  # of the largest move: there the skin is the bone's
FAR = 0.7  # distances between the eyes; a joint farther than that from where joints are is none


def joint_of(at: Float64, move: Float64, usual: Float64, eyes: float) -> tuple[Float64, bool]:
    """Return the axis of the jaw (3,) in metres, found from what a jaw-opening shape moves most.

    A turn about +x by a moves y and z by A (p - c), A = [[cos a - 1, -sin a], [sin a, cos a - 1]]: two
    numbers and a shift, which least squares find.

    Args:
        at: (n, 3) metres; move: (n, 3), the jaw's opening.
        usual: (3,) the joint by proportions; eyes: metres between the eyes.

    Returns:
        The joint, and whether it was found from the shape; if not, it is `usual`.
    """
    size = np.linalg.norm(move, axis=1)
    if size.max() < 1e-6:
        return usual, False
    mine = size > STRONG * size.max()
    y, z = at[mine, 1], at[mine, 2]
    one, none = np.ones_like(y), np.zeros_like(y)
    rows = np.concatenate(
        [np.stack([y, -z, one, none], 1), np.stack([z, y, none, one], 1)]
    )  # unknown: cos a - 1, sin a, shift of y, shift of z
    (c, s, dy, dz), *_ = np.linalg.lstsq(rows, np.concatenate([move[mine, 1], move[mine, 2]]), rcond=None)
    turn = np.array([[c, -s], [s, c]])
    if abs(np.linalg.det(turn)) < 1e-6:
        return usual, False
    place = np.array([usual[0], *np.linalg.solve(turn, [-dy, -dz])])
    plausible = bool(s > 0 and np.linalg.norm(place - usual) < FAR * eyes)
    return (place, True) if plausible else (usual, False)


def drag_of(at: Float64, move: Float64, pivot: Float64, chin: int) -> Float64:
    """Return how far each vertex follows the jaw when it opens as in the shape, (n,) 0..1.

    Args:
        move: (n, 3), the opening; chin: the vertex that goes all the way.
    """
    arm = at - pivot
    angle = float(np.linalg.norm(move[chin, 1:]) / max(float(np.linalg.norm(arm[chin, 1:])), 1e-9))
    turned = np.zeros_like(arm)
    turned[:, 1] = arm[:, 1] * (np.cos(angle) - 1) - arm[:, 2] * np.sin(angle)
    turned[:, 2] = arm[:, 1] * np.sin(angle) + arm[:, 2] * (np.cos(angle) - 1)
    share = (move * turned).sum(axis=1) / np.maximum((turned**2).sum(axis=1), 1e-12)
    share = share / max(float(share[chin]), 1e-6)
    return np.asarray(np.clip(share, 0, 1))
