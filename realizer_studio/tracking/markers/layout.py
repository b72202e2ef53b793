"""Layouts of markers: their places on a face at rest, and the constraints that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float64, Index
from realizer.core.errors import TableError
from realizer.face.features import NAMES
from realizer.face.mesh_geometry import flat_cross
from realizer.tables import csv_rows, read_csv
from realizer_studio.tracking.network import TrackingError

FILE = "wojdel.csv"
LOWEST = 0.25  # least height of a triangle whose orientation cannot change, relative to the layout's size
WIDE = 0.45  # least base of a line, relative to the same
FEWEST = 3  # markers
LINE_OF_TEXT = 0.06  # of the height; markers nearer than this are numbered from left to right


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a file of a layout."""

    point: str
    feature_point: str
    x: float
    y: float
    colour: int


@dataclass(frozen=True, eq=False)
class Layout:
    """Markers of a face at rest."""

    names: tuple[str, ...]  # of the points
    feature_points: tuple[str, ...]  # of MPEG-4 whose FAPs they show; "" for none
    colours: Index  # (k,) which colour each has, from 0
    places: Float64  # (k, 2) x to the person's left, y up, in any unit

    def __len__(self) -> int:
        return len(self.names)

    @property
    def size(self) -> float:
        """The root of the mean square distance of the points from their middle."""
        return float(np.sqrt(np.square(self.places - self.places.mean(axis=0)).sum(axis=1).mean()))

    def at(self, places: Float64) -> Layout:
        """Return the layout with other places (k, 2)."""
        return replace(self, places=places)

    def with_colours(self, count: int) -> Layout:
        """Return it for as many colours: without a second one, all markers have the first."""
        return replace(self, colours=np.minimum(self.colours, count - 1))


def wojdel() -> Layout:
    """Return the 31 points of Wojdel's figure 7.4."""
    return _layout(csv_rows(FILE, Row, __package__), FILE)


def read_layout(path: Path) -> Layout:
    """Return the layout of a user's file, in the form of `wojdel.csv`; its head lines may be left out.

    Raises:
        TrackingError: another file, too few points, or a point that is there twice.
    """
    try:
        text = path.read_text("utf-8-sig")
        head = "" if text.startswith("#") else "# source: \n# units: \n# licence: \n"
        return _layout(read_csv(head + text, Row, str(path)), str(path))
    except (OSError, UnicodeError, TableError) as error:
        raise TrackingError(
            f"{path}: wanted a table of markers as in docs/tracking.md, got: {error}"
        ) from None


def numbered(blobs: Float64) -> Layout:
    """Return the layout of blobs (n, 3): numbers from the upper left to the lower right."""
    tall = max(float(np.ptp(blobs[:, 1])), 1.0) * LINE_OF_TEXT
    lines: list[list[int]] = []
    for k in np.argsort(blobs[:, 1], kind="stable").tolist():
        if not lines or blobs[k, 1] - blobs[lines[-1][0], 1] > tall:
            lines.append([])
        lines[-1].append(k)
    blobs = blobs[[k for line in lines for k in sorted(line, key=lambda one: blobs[one, 0])]]
    names = tuple(str(k + 1) for k in range(len(blobs)))
    return Layout(names, ("",) * len(names), blobs[:, 2].astype(np.intp), blobs[:, :2] * (1, -1))


def constraints(layout: Layout) -> Index:
    """Return triples of points (n, 3) that run counterclockwise whatever the face does.

    Orientation constraints are triangles of the Delaunay triangulation. Line constraints are a point and two
    others far apart: it stays on its side of the line through them. Both are redundant, as points may be
    missing (7.1.3).
    """
    from scipy.spatial import Delaunay, QhullError

    places, size = layout.places, layout.size
    try:
        found = [tuple(map(int, row)) for row in Delaunay(places).simplices]
    except (QhullError, ValueError):  # all on one line
        return np.zeros((0, 3), np.intp)
    pairs = [(a, b) for a in range(len(places)) for b in range(a)]
    long = np.array(
        [pair for pair in pairs if np.linalg.norm(np.subtract(*places[list(pair)])) > WIDE * size]
    )
    for point in range(len(places)):
        triangles = np.column_stack([long, np.full(len(long), point)])
        heights = _heights(places, triangles)
        for side in (heights, -heights):
            far = np.where(side > LOWEST * size, side, np.inf)
            if np.isfinite(far).any():
                found.append(tuple(triangles[far.argmin()].tolist()))
    found = [row for row in found if abs(_heights(places, np.array([row]))[0]) > LOWEST * size]
    rows = np.array(sorted({tuple(sorted(row)) for row in found}), np.intp).reshape(-1, 3)
    turned = _turn(places, rows) < 0
    rows[turned] = rows[turned][:, [0, 2, 1]]
    return rows


def broken(places: Float64, rows: Index) -> Index:
    """Return how many constraints (n, 3) each of points (k, 2) breaks; NaN breaks none."""
    with np.errstate(invalid="ignore"):
        wrong = rows[_turn(places, rows) < 0]
    return np.bincount(wrong.ravel(), minlength=len(places))


def _layout(rows: Sequence[Row], where: str) -> Layout:
    names = tuple(row.point for row in rows)
    shown = [row.feature_point or (row.point if row.point in NAMES else "") for row in rows]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise TrackingError(f"{where}: wanted each point once, got {twice[0]!r} twice")
    if unknown := [name for name in shown if name and name not in NAMES]:
        raise TrackingError(f"{where}: wanted feature points of MPEG-4, 2.1 to 11.6, got {unknown[0]!r}")
    places = np.array([(row.x, row.y) for row in rows], np.float64).reshape(-1, 2)
    colours = np.array([row.colour - 1 for row in rows], np.intp)
    if (
        len(rows) < FEWEST
        or not np.isfinite(places).all()
        or colours.min() < 0
        or not np.ptp(places, axis=0).any()
    ):
        raise TrackingError(
            f"{where}: wanted {FEWEST} points or more at different finite places, with colours from 1"
        )
    return Layout(names, tuple(shown), colours, places)


def _turn(places: Float64, rows: Index) -> Float64:
    """Return twice the areas (n,) of triangles, positive if counterclockwise."""
    a, b, c = places[rows[:, 0]], places[rows[:, 1]], places[rows[:, 2]]
    return flat_cross(b - a, c - a)


def _heights(places: Float64, rows: Index) -> Float64:
    """Return the least heights (n,) of triangles, positive if counterclockwise."""
    corners = places[rows]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    return np.asarray(_turn(places, rows) / np.maximum(longest, 1e-12))
