"""Automatic placement of the 84 feature points on an unmarked head.

The template's points are carried over: a smooth map takes the places that the template's shape shows (eyes,
lids, profile, mouth corners, ears) to where this head shows them, and each point goes to the nearest skin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.features import INSIDE, NAMES, Point
from realizer.face.mesh_geometry import nearest_vertex, part_triangles, vertex_normals
from realizer.tables import csv_rows
from realizer_studio.faces.mpeg4.head_geometry import HeadGeometry, find_anchors
from realizer_studio.faces.mpeg4.rigid import balls

NEAR = 0.22  # eye distances; a point farther than this from all evidence is a guess
OFF = 0.06  # eye distances; so is one that had to go this far to the skin
TEETH = {"9.8": ("upper_teeth", 1), "9.10": ("upper_teeth", -1), "9.11": ("lower_teeth", 1),
         "9.9": ("lower_teeth", -1)}  # fmt: skip
PUPILS = {"3.5": "left_eye", "3.6": "right_eye"}
# The lips touch: the skin's normal shows on which side of the slit a point lies.
FACING = {"2.2": -1, "2.6": -1, "2.7": -1, "2.3": 1, "2.8": 1, "2.9": 1}
ROUND = ("10.", "11.")  # ears, hair and skull have few places of their own: always a guess
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
    points = {name: place for name, place in rows.items() if name[0].isdigit()}
    return points, {name: place for name, place in rows.items() if name not in points}


def head_of(
    vertices: Float64, triangles: Int32, parts: Mapping[str, tuple[int, int]]
) -> tuple[HeadGeometry, Float64, float]:
    """Return the head in its own measure, its origin (3,), and its unit in metres."""
    at = np.asarray(vertices, np.float64)
    (left, radius), (right, other) = balls(at, parts)
    unit = float(left[0] - right[0])
    if not np.isfinite(unit) or unit <= 0 or abs(left[1] - right[1]) > 0.3 * unit:
        raise FaceError(
            f"the eyeballs lie at {np.round(left, 4).tolist()} and {np.round(right, 4).tolist()}: wanted the "
            "left one at the larger x and both at one height; turn the head: +x its left, +y up, +z forward"
        )
    origin = (left + right) / 2
    mine = part_triangles(triangles, parts["skin"])
    skin = (at[slice(*parts["skin"])] - origin) / unit
    head = HeadGeometry(
        skin, mine, vertex_normals(skin, mine), (left - origin) / unit, (right - origin) / unit,
        (radius + other) / 2 / unit,
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
        The 84 points, and the names of those that are guesses: look at them, and move them.

    Raises:
        FaceError: a part is missing, or the eyeballs do not stand side by side.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    for name in ("skin", "left_eye", "right_eye"):
        if name not in parts:
            raise FaceError(f"parts: wanted {name!r}, got {', '.join(parts) or 'none'}")
    head, origin, unit = head_of(vertices, triangles, parts)
    marks, anchors = template()
    found = find_anchors(head)
    shared = [name for name in anchors if name in found]
    found |= {name: np.where(np.isfinite(found[name]), found[name], anchors[name]) for name in shared}
    here = np.array([*(found[name] for name in shared), head.left, head.right])
    there = np.array([*(anchors[name] for name in shared), [0.5, 0, 0], [-0.5, 0, 0]])
    carry = RBFInterpolator(there, here - there, kernel="thin_plate_spline", degree=1, smoothing=1e-4)
    names = [name for name in NAMES if name in marks]
    places = np.array([marks[name] for name in names])
    places = places + carry(places)
    sure = np.array([found[name] for name in shared])
    far = cKDTree(sure).query(places)[0] if len(sure) else np.full(len(places), np.inf)
    out: dict[str, Point] = {}
    guesses = []
    for name, place, away in zip(names, places, np.atleast_1d(far), strict=True):
        vertex, at, off = _settled(name, place * unit + origin, vertices, parts, head, origin, unit)
        out[name] = Point(name, vertex, *at.tolist())
        lost = name in CORNER_POINTS and "l_corner" not in found
        vague = away > NEAR or off > OFF * unit or lost or name.startswith(ROUND)
        if vague and name not in PUPILS and name not in TEETH:
            guesses.append(name)
    return out, tuple(guesses)


def _settled(
    name: str, place: Float64, vertices: Float64, parts: Mapping[str, tuple[int, int]],
    head: HeadGeometry, origin: Float64, unit: float,
) -> tuple[int, Float64, float]:  # fmt: skip
    """Return the vertex of a point, the point itself, and its distance from the skin in metres."""
    at = np.asarray(vertices, np.float64)

    if name in INSIDE:
        part = "skin" if name == "7.1" or "hair" not in parts else "hair"
        return nearest_vertex(at, place, parts[part]), place, 0.0
    if name in PUPILS:
        first, last = parts[PUPILS[name]]
        vertex = first + int(np.argmax(at[first:last, 2]))
        return vertex, at[vertex], 0.0
    if name in TEETH and TEETH[name][0] in parts:
        part, way = TEETH[name]
        first, last = parts[part]
        mine = at[first:last]
        middle = (np.abs(mine[:, 0] - origin[0]) < 0.04 * unit) & (
            mine[:, 2] > mine[:, 2].max() - 0.06 * unit
        )
        chosen = np.flatnonzero(middle) if middle.any() else np.arange(len(mine))
        vertex = first + int(chosen[np.argmax(way * mine[chosen, 1])])
        return vertex, at[vertex], 0.0
    if name.startswith("4.") and "brows" in parts:
        place = _on_brow(at[slice(*parts["brows"])], place, origin, unit)
    part = "tongue" if name.startswith("6.") and "tongue" in parts else "skin"
    vertex = nearest_vertex(at, place, parts[part])
    if name in FACING:
        first, last = parts["skin"]
        right = np.flatnonzero(head.ups[:, 1] * FACING[name] > -0.1)
        vertex = first + int(right[np.argmin(np.linalg.norm(at[first:last][right] - place, axis=1))])
    return vertex, at[vertex], float(np.linalg.norm(at[vertex] - place))


def _on_brow(brows: Float64, place: Float64, origin: Float64, unit: float) -> Float64:
    """Return the place moved to the height of the brow, between its ends."""
    mine = brows[(brows[:, 0] > origin[0]) == (place[0] > origin[0])]
    if not len(mine):
        return place
    x = float(np.clip(place[0], mine[:, 0].min(), mine[:, 0].max()))
    near = mine[np.abs(mine[:, 0] - x) < 0.06 * unit]
    return np.asarray(near.mean(axis=0)) if len(near) else place
