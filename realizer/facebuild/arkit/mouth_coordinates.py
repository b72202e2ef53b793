"""Coordinates around the mouth: along, across, above and below."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import edge_graph, half_edges, neighbour_mean
from realizer.facebuild.mpeg4.zones import Triple
from realizer.facebuild.person.lips import spline_basis

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
