"""Automatic placement of the 84 feature points on an unmarked head.

A thin-plate spline maps the anchors of a template (eyes, lids, profile, corners of the mouth, ears) to those
found on the head. It moves the template's feature points, and each is then placed on the nearest skin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.features import INSIDE, NAMES, Point
from realizer.face.mesh_geometry import nearest_vertex, part_triangles, vertex_normals
from realizer.tables import csv_rows
from realizer_studio.faces.mpeg4.head_geometry import HeadGeometry, find_anchors
from realizer_studio.faces.mpeg4.rigid import balls

MAX_ANCHOR_DISTANCE = 0.22  # eye distances; a point farther from all anchors is a guess
MAX_SHIFT = 0.06  # eye distances; a point that was farther from the skin is a guess
TEETH = {"9.8": ("upper_teeth", 1), "9.10": ("upper_teeth", -1), "9.11": ("lower_teeth", 1),
         "9.9": ("lower_teeth", -1)}  # fmt: skip
PUPILS = {"3.5": "left_eye", "3.6": "right_eye"}
# The lips touch: the skin's normal shows on which side of the slit a point lies.
FACING = {"2.2": -1, "2.6": -1, "2.7": -1, "2.3": 1, "2.8": 1, "2.9": 1}
ROUND = ("10.", "11.")  # points of ears, hair and skull are always guesses: few anchors are there
CORNER_POINTS = {"2.4", "2.5", "8.3", "8.4"}


@dataclass(frozen=True)
class _Template:
    name: str
    x: float
    y: float
    z: float


@cache
def template() -> tuple[dict[str, Float64], dict[str, Float64]]:
    """Return feature points and anchors of the template, in eye distances from between the eyes."""
    table = csv_rows("template.csv", _Template, __package__)
    rows = {row.name: np.array([row.x, row.y, row.z]) for row in table}
    points = {name: position for name, position in rows.items() if name[0].isdigit()}
    return points, {name: position for name, position in rows.items() if name not in points}


def head_of(
    vertices: Float64, triangles: Int32, parts: Mapping[str, tuple[int, int]]
) -> tuple[HeadGeometry, Float64, float]:
    """Return the head measured in eye distances, its origin (3,), and its eye distance, metres."""
    at = np.asarray(vertices, np.float64)
    (left, radius), (right, other) = balls(at, parts)
    unit = float(left[0] - right[0])
    if not np.isfinite(unit) or unit <= 0 or abs(left[1] - right[1]) > 0.3 * unit:
        raise FaceError(
            f"the eyeballs lie at {np.round(left, 4).tolist()} and {np.round(right, 4).tolist()}: wanted the "
            "left one at the larger x and both at one height; turn the head: +x its left, +y up, +z forward"
        )
    origin = (left + right) / 2
    skin_triangles = part_triangles(triangles, parts["skin"])
    skin = (at[slice(*parts["skin"])] - origin) / unit
    head = HeadGeometry(
        skin, skin_triangles, vertex_normals(skin, skin_triangles),
        (left - origin) / unit, (right - origin) / unit, (radius + other) / 2 / unit,
    )  # fmt: skip
    return head, origin, unit


def find_points(
    vertices: Float64, triangles: Int32, parts: Mapping[str, tuple[int, int]]
) -> tuple[dict[str, Point], tuple[str, ...]]:
    """Find the feature points of a head.

    Args:
        vertices: (n, 3) metres, +x the character's left, +y up, +z forward; triangles: (m, 3).
        parts: vertex ranges; skin, left_eye and right_eye are needed, teeth and tongue help.

    Returns:
        The 84 points, and the names of those that are guesses, for a person to check.

    Raises:
        FaceError: a part is missing, or the eyeballs do not stand side by side.
    """
    for name in ("skin", "left_eye", "right_eye"):
        if name not in parts:
            raise FaceError(f"parts: wanted {name!r}, got {', '.join(parts) or 'none'}")
    head, origin, unit = head_of(vertices, triangles, parts)
    marks, anchors = template()
    found = find_anchors(head)
    shared = [name for name in anchors if name in found]
    found |= {name: np.where(np.isfinite(found[name]), found[name], anchors[name]) for name in shared}
    target = np.array([*(found[name] for name in shared), head.left, head.right])
    source = np.array([*(anchors[name] for name in shared), [0.5, 0, 0], [-0.5, 0, 0]])
    warp = RBFInterpolator(source, target - source, kernel="thin_plate_spline", degree=1, smoothing=1e-4)
    names = [name for name in NAMES if name in marks]
    positions = np.array([marks[name] for name in names])
    positions = positions + warp(positions)
    evidence = np.array([found[name] for name in shared])
    distances = cKDTree(evidence).query(positions)[0] if len(evidence) else np.full(len(positions), np.inf)
    out: dict[str, Point] = {}
    guesses = []
    for name, position, distance in zip(names, positions, np.atleast_1d(distances), strict=True):
        vertex, point, shift = _surface_point(
            name, position * unit + origin, vertices, parts, head, origin, unit
        )
        out[name] = Point(name, vertex, *point.tolist())
        unknown = name in CORNER_POINTS and "l_corner" not in found
        vague = (
            distance > MAX_ANCHOR_DISTANCE or shift > MAX_SHIFT * unit or unknown or name.startswith(ROUND)
        )
        if vague and name not in PUPILS and name not in TEETH:
            guesses.append(name)
    return out, tuple(guesses)


def _surface_point(
    name: str, position: Float64, vertices: Float64, parts: Mapping[str, tuple[int, int]],
    head: HeadGeometry, origin: Float64, unit: float,
) -> tuple[int, Float64, float]:  # fmt: skip
    """Return the vertex of a point, the point itself, and its distance from the skin in metres."""
    at = np.asarray(vertices, np.float64)

    if name in INSIDE:
        part = "skin" if name == "7.1" or "hair" not in parts else "hair"
        return nearest_vertex(at, position, parts[part]), position, 0.0
    if name in PUPILS:
        first, last = parts[PUPILS[name]]
        vertex = first + int(np.argmax(at[first:last, 2]))
        return vertex, at[vertex], 0.0
    if name in TEETH and TEETH[name][0] in parts:
        part, sign = TEETH[name]
        first, last = parts[part]
        teeth = at[first:last]
        middle = (np.abs(teeth[:, 0] - origin[0]) < 0.04 * unit) & (
            teeth[:, 2] > teeth[:, 2].max() - 0.06 * unit
        )
        chosen = np.flatnonzero(middle) if middle.any() else np.arange(len(teeth))
        vertex = first + int(chosen[np.argmax(sign * teeth[chosen, 1])])
        return vertex, at[vertex], 0.0
    if name.startswith("4.") and "brows" in parts:
        position = _on_brow(at[slice(*parts["brows"])], position, origin, unit)
    part = "tongue" if name.startswith("6.") and "tongue" in parts else "skin"
    vertex = nearest_vertex(at, position, parts[part])
    if name in FACING:
        first, last = parts["skin"]
        facing = np.flatnonzero(head.normals[:, 1] * FACING[name] > -0.1)
        vertex = first + int(facing[np.argmin(np.linalg.norm(at[first:last][facing] - position, axis=1))])
    return vertex, at[vertex], float(np.linalg.norm(at[vertex] - position))


def _on_brow(brows: Float64, position: Float64, origin: Float64, unit: float) -> Float64:
    """Return the position moved onto the brow: to its height, and not beyond its ends."""
    side = brows[(brows[:, 0] > origin[0]) == (position[0] > origin[0])]
    if not len(side):
        return position
    x = float(np.clip(position[0], side[:, 0].min(), side[:, 0].max()))
    nearby = side[np.abs(side[:, 0] - x) < 0.06 * unit]
    return np.asarray(nearby.mean(axis=0)) if len(nearby) else position
