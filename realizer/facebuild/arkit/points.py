"""The 84 feature points of an imported head, found by form and by shapes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.features import Point
from realizer.face.mesh_geometry import nearest_vertex, vertex_normals
from realizer.facebuild.arkit.mesh_merge import Surface
from realizer.facebuild.arkit.part_classifier import ball_behind
from realizer.facebuild.mpeg4.landmarks import find_points

PUPILS = {"left_eye": "3.5", "right_eye": "3.6"}
SPHERE = np.concatenate([np.eye(3), -np.eye(3), np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1)
                                                          for z in (-1, 1)]) / np.sqrt(3)])  # fmt: skip
HALF = {"2.6": "2.8", "2.7": "2.9"}  # upper -> lower, half-way to the corners
NEAR = 0.0035  # m aside of a station in which the lips are looked for
DEEP = 0.012  # m behind the front of the lips
LIPS = 0.016  # m above and below the slit
BACK = 0.35  # a metre farther back weighs as much as so much farther from the other lip


def points_of(
    surface: Surface, ranges: Mapping[str, tuple[int, int]], painted: bool = False
) -> tuple[dict[str, Point], tuple[str, ...]]:
    """Return the feature points, and the names of those that are guesses.

    The form decides most points (`mpeg4.find_points`); where the lips meet and at the edges of the lids the
    shapes decide: vertices that move with the upper lip belong to it, however close the lower lip is.

    Raises:
        FaceError: the eyes do not stand side by side.
    """
    at, parts = surface.vertices, dict(ranges)
    if painted:
        # Eyes that are part of the skin cannot be measured as balls: assume balls behind them.
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
    sure = _lids(skin, points, first) | _slit(skin, points, first)
    points |= {name: Point(name, vertex, *surface.vertices[vertex]) for name, vertex in sure.items()}
    return points, tuple(name for name in guesses if name not in sure)


def _size(surface: Surface, *names: str) -> Any:
    """Return how far shapes move each vertex, (n,) metres, or None if a shape is missing."""
    total = surface.total(*names)
    return None if total is None else np.linalg.norm(total, axis=1)


def _slit(skin: Surface, points: Mapping[str, Point], first: int) -> dict[str, int]:
    """Return the inner contours of the lips: where the regions of the two lips' shapes touch, in front."""
    from scipy.spatial import cKDTree

    up = _size(skin, "mouthUpperUpLeft", "mouthUpperUpRight")
    down = _size(skin, "mouthLowerDownLeft", "mouthLowerDownRight")
    if up is None or down is None or not up.any() or not down.any():
        return {}
    at = skin.vertices
    middle = (np.array(points["2.2"].place) + np.array(points["2.3"].place)) / 2
    front = max(points["8.1"].z, points["8.2"].z)
    box = (np.abs(at[:, 1] - middle[1]) < LIPS) & (at[:, 2] > front - DEEP)
    box &= np.abs(at[:, 0]) < abs(points["2.4"].x) * 0.8
    upper, lower = np.flatnonzero(box & (up > down)), np.flatnonzero(box & (down > up))
    if len(upper) < 4 or len(lower) < 4:
        return {}
    out = {}
    for mine, others, names in (
        (upper, lower, {"2.2": 0.0} | {k: points[k].x for k in HALF}),
        (lower, upper, {"2.3": 0.0} | {k: points[k].x for k in HALF.values()}),
    ):
        apart = np.asarray(cKDTree(at[others]).query(at[mine])[0])
        cost = apart + BACK * (front - at[mine, 2])
        for name, x in names.items():
            aside = np.abs(at[mine, 0] - x)
            near = np.flatnonzero(aside < max(NEAR, 1.01 * float(aside.min())))
            best = near[np.argmin(cost[near] + 0.5 * aside[near])]
            out[name] = first + int(mine[best])
    return out


def _lids(skin: Surface, points: Mapping[str, Point], first: int) -> dict[str, int]:
    """Return the edges of the lids above and below the pupil, found from the blink."""
    out: dict[str, int] = {}
    ups = vertex_normals(skin.vertices, skin.triangles)
    for word, top, bottom, pupil in (("Left", "3.1", "3.3", "3.5"), ("Right", "3.2", "3.4", "3.6")):
        blink = skin.moves.get(f"eyeBlink{word}")
        if blink is None or not blink.any():
            continue
        at: Float64 = skin.vertices
        aside = np.abs(at[:, 0] - points[pupil].x)
        fall = -blink[:, 1] - 0.3 * aside
        near = (aside < 0.004) & (at[:, 2] > points[pupil].z - 0.012)
        if not near.any() or fall[near].max() <= 0:
            continue
        # The edge's front, not the lining that goes down with it.
        strong = np.flatnonzero(near & (fall > 0.93 * fall[near].max()))
        upper = int(strong[np.argmax(at[strong, 2])])
        shut = at + blink
        off = np.linalg.norm(shut - shut[upper], axis=1)
        lower = np.flatnonzero(
            (at[:, 1] < at[upper, 1] - 0.3 * float(-blink[upper, 1]))
            & (blink[:, 1] > -1e-4)
            & (ups[:, 2] > 0)
        )
        if not len(lower):
            continue
        out |= {top: first + upper, bottom: first + int(lower[np.argmin(off[lower])])}
    return out
