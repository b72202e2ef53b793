"""Layouts of markers: their positions on a face at rest, and constraints on their positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError

from realizer.core.array_types import Float64, Index
from realizer.core.errors import TableError
from realizer.face.features import NAMES
from realizer.face.mesh_geometry import flat_cross
from realizer.tables import csv_rows, read_csv
from realizer_studio.tracking.network import TrackingError

FILE = "wojdel.csv"
LOWEST = 0.25  # least height of a triangle with a constant orientation, relative to the layout's size
WIDE = 0.45  # least distance of the points of a line, relative to the same
FEWEST = 3  # markers
LINE_OF_TEXT = 0.06  # of the height; markers within it are numbered from left to right


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
    feature_points: tuple[str, ...]  # of MPEG-4; "" for none
    colours: Index  # (k,) the number of each one's colour, from 0
    positions: Float64  # (k, 2) x to the person's left, y up, in any unit

    def __len__(self) -> int:
        return len(self.names)

    @property
    def size(self) -> float:
        """The root of the mean square distance of the points from their centroid."""
        return float(np.sqrt(np.square(self.positions - self.positions.mean(axis=0)).sum(axis=1).mean()))

    def with_positions(self, positions: Float64) -> Layout:
        """Return the layout with other positions (k, 2)."""
        return replace(self, positions=positions)

    def with_colours(self, count: int) -> Layout:
        """Return the layout limited to a number of colours."""
        return replace(self, colours=np.minimum(self.colours, count - 1))


def wojdel() -> Layout:
    """Return the 31 points of Wojdel's figure 7.4."""
    return _layout(csv_rows(FILE, Row, __package__), FILE)


def read_layout(path: Path) -> Layout:
    """Read the layout in a user's file, which has the form of `wojdel.csv`, with or without its head lines.

    Raises:
        TrackingError: another file, too few points, or a repeated point.
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
    """Return triples of points (n, 3) that are counterclockwise in all expressions of a face.

    Orientation constraints are triangles of the Delaunay triangulation. Line constraints are a point and two
    distant others: the point stays on one side of the line through them. They are redundant, because points
    can be missing (7.1.3).
    """
    positions, size = layout.positions, layout.size
    try:
        found = [tuple(map(int, row)) for row in Delaunay(positions).simplices]
    except (QhullError, ValueError):  # all on one line
        return np.zeros((0, 3), np.intp)
    pairs = [(a, b) for a in range(len(positions)) for b in range(a)]
    wide_pairs = np.array(
        [pair for pair in pairs if np.linalg.norm(np.subtract(*positions[list(pair)])) > WIDE * size]
    )
    for point in range(len(positions)):
        triangles = np.column_stack([wide_pairs, np.full(len(wide_pairs), point)])
        heights = _heights(positions, triangles)
        for side in (heights, -heights):
            far = np.where(side > LOWEST * size, side, np.inf)
            if np.isfinite(far).any():
                found.append(tuple(triangles[far.argmin()].tolist()))
    found = [row for row in found if abs(_heights(positions, np.array([row]))[0]) > LOWEST * size]
    rows = np.array(sorted({tuple(sorted(row)) for row in found}), np.intp).reshape(-1, 3)
    turned = _signed_areas(positions, rows) < 0
    rows[turned] = rows[turned][:, [0, 2, 1]]
    return rows


def broken(positions: Float64, rows: Index) -> Index:
    """Return the number of constraints (n, 3) that each of points (k, 2) breaks; NaN breaks none."""
    with np.errstate(invalid="ignore"):
        broken_rows = rows[_signed_areas(positions, rows) < 0]
    return np.bincount(broken_rows.ravel(), minlength=len(positions))


def _layout(rows: Sequence[Row], where: str) -> Layout:
    names = tuple(row.point for row in rows)
    feature_points = [row.feature_point or (row.point if row.point in NAMES else "") for row in rows]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise TrackingError(f"{where}: wanted each point once, got {repeated[0]!r} twice")
    if unknown := [name for name in feature_points if name and name not in NAMES]:
        raise TrackingError(f"{where}: wanted feature points of MPEG-4, 2.1 to 11.6, got {unknown[0]!r}")
    positions = np.array([(row.x, row.y) for row in rows], np.float64).reshape(-1, 2)
    colours = np.array([row.colour - 1 for row in rows], np.intp)
    if (
        len(rows) < FEWEST
        or not np.isfinite(positions).all()
        or colours.min() < 0
        or not np.ptp(positions, axis=0).any()
    ):
        raise TrackingError(
            f"{where}: wanted {FEWEST} points or more at different finite places, with colours from 1"
        )
    return Layout(names, tuple(feature_points), colours, positions)


def _signed_areas(positions: Float64, rows: Index) -> Float64:
    """Return twice the areas (n,) of triangles, positive if counterclockwise."""
    a, b, c = positions[rows[:, 0]], positions[rows[:, 1]], positions[rows[:, 2]]
    return flat_cross(b - a, c - a)


def _heights(positions: Float64, rows: Index) -> Float64:
    """Return the least heights (n,) of triangles, positive if counterclockwise."""
    corners = positions[rows]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    return np.asarray(_signed_areas(positions, rows) / np.maximum(longest, 1e-12))
