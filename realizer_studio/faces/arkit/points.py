"""The 84 feature points of an imported head, located by its geometry and its blend shapes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64
from realizer.face.features import Point
from realizer.face.mesh_geometry import nearest_vertex, vertex_normals
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.arkit.part_classifier import ball_behind
from realizer_studio.faces.mpeg4.point_finder import find_points

PUPILS = {"left_eye": "3.5", "right_eye": "3.6"}
SPHERE = np.concatenate([np.eye(3), -np.eye(3), np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1)
                                                          for z in (-1, 1)]) / np.sqrt(3)])  # fmt: skip
HALF = {"2.6": "2.8", "2.7": "2.9"}  # points half-way to the corners: upper lip -> lower lip
SEARCH_WIDTH = 0.0035  # m on either side of a point's x
LIP_DEPTH = 0.012  # m behind the front of the lips
LIP_HEIGHT = 0.016  # m above and below the middle of the mouth
DEPTH_WEIGHT = 0.35  # cost of a metre of depth, relative to a metre of distance from the other lip


def points_of(
    surface: Surface, ranges: Mapping[str, tuple[int, int]], painted: bool = False
) -> tuple[dict[str, Point], tuple[str, ...]]:
    """Return the feature points, and the names of those that are guesses.

    Most points come from the geometry (`point_finder.find_points`). The inner contours of the lips and the
    edges of the lids come from blend shapes: vertices that move with the upper lip belong to it, even beside
    the lower lip.

    Args:
        painted: whether the eyes are part of the skin.

    Raises:
        FaceError: the eyes are not beside each other.
    """
    at, parts = surface.vertices, dict(ranges)
    if painted:
        # Painted eyes have no eyeballs to measure, so eyeballs are assumed behind them.
        for name in PUPILS:
            centre, radius = ball_behind(surface.vertices[slice(*ranges[name])])
            parts[name] = (len(at), len(at) + len(SPHERE))
            at = np.concatenate([at, centre + radius * SPHERE])
    points, guesses = find_points(at, surface.triangles, parts)
    if painted:
        for name, pupil in PUPILS.items():
            vertex = nearest_vertex(at, points[pupil].place, ranges[name])
            points[pupil] = Point(pupil, vertex, *at[vertex])
    first, last = ranges["skin"]
    skin = surface.subset(np.arange(first, last))
    certain = _lids(skin, points, first) | _inner_lips(skin, points, first)
    points |= {name: Point(name, vertex, *surface.vertices[vertex]) for name, vertex in certain.items()}
    return points, tuple(name for name in guesses if name not in certain)


def _size(surface: Surface, *names: str) -> Any:
    """Return the displacement of each vertex by shapes, (n,) metres, or None if a shape is missing."""
    total = surface.total(*names)
    return None if total is None else np.linalg.norm(total, axis=1)


def _inner_lips(skin: Surface, points: Mapping[str, Point], first: int) -> dict[str, int]:
    """Return the points of the inner contours, where the regions of the two lips' shapes touch in front."""
    up = _size(skin, "mouthUpperUpLeft", "mouthUpperUpRight")
    down = _size(skin, "mouthLowerDownLeft", "mouthLowerDownRight")
    if up is None or down is None or not up.any() or not down.any():
        return {}
    at = skin.vertices
    middle = (np.array(points["2.2"].place) + np.array(points["2.3"].place)) / 2
    front = max(points["8.1"].z, points["8.2"].z)
    box = (np.abs(at[:, 1] - middle[1]) < LIP_HEIGHT) & (at[:, 2] > front - LIP_DEPTH)
    box &= np.abs(at[:, 0]) < abs(points["2.4"].x) * 0.8
    upper, lower = np.flatnonzero(box & (up > down)), np.flatnonzero(box & (down > up))
    if len(upper) < 4 or len(lower) < 4:
        return {}
    out = {}
    for lip, other, names in (
        (upper, lower, {"2.2": 0.0} | {k: points[k].x for k in HALF}),
        (lower, upper, {"2.3": 0.0} | {k: points[k].x for k in HALF.values()}),
    ):
        distance = np.asarray(cKDTree(at[other]).query(at[lip])[0])
        cost = distance + DEPTH_WEIGHT * (front - at[lip, 2])
        for name, x in names.items():
            lateral = np.abs(at[lip, 0] - x)
            nearby = np.flatnonzero(lateral < max(SEARCH_WIDTH, 1.01 * float(lateral.min())))
            best = nearby[np.argmin(cost[nearby] + 0.5 * lateral[nearby])]
            out[name] = first + int(lip[best])
    return out


def _lids(skin: Surface, points: Mapping[str, Point], first: int) -> dict[str, int]:
    """Return the edges of the lids above and below the pupil, found from the blink."""
    out: dict[str, int] = {}
    normals = vertex_normals(skin.vertices, skin.triangles)
    for word, top, bottom, pupil in (("Left", "3.1", "3.3", "3.5"), ("Right", "3.2", "3.4", "3.6")):
        blink = skin.moves.get(f"eyeBlink{word}")
        if blink is None or not blink.any():
            continue
        at: Float64 = skin.vertices
        lateral = np.abs(at[:, 0] - points[pupil].x)
        fall = -blink[:, 1] - 0.3 * lateral
        nearby = (lateral < 0.004) & (at[:, 2] > points[pupil].z - 0.012)
        if not nearby.any() or fall[nearby].max() <= 0:
            continue
        # The foremost vertex is taken, because the inside of the lid moves down too.
        strong = np.flatnonzero(nearby & (fall > 0.93 * fall[nearby].max()))
        upper = int(strong[np.argmax(at[strong, 2])])
        closed = at + blink
        distance = np.linalg.norm(closed - closed[upper], axis=1)
        lower = np.flatnonzero(
            (at[:, 1] < at[upper, 1] - 0.3 * float(-blink[upper, 1]))
            & (blink[:, 1] > -1e-4)
            & (normals[:, 2] > 0)
        )
        if not len(lower):
            continue
        out |= {top: first + upper, bottom: first + int(lower[np.argmin(distance[lower])])}
    return out
