"""Tracking of markers in a film: detection, ordering, repair, removal of head motion; their files."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours.keyframes import document_of
from realizer.core.array_types import Bool, Float64, Index
from realizer.face.load import load_face
from realizer.outputs.csv_table import csv_text
from realizer.outputs.fap_text import encode
from realizer.tables import HEAD_COLUMNS
from realizer.tables import faps as fap_rows
from realizer_studio.analysis.faps_from_points import faps_from_points
from realizer_studio.tracking.files import clip_of
from realizer_studio.tracking.markers.colours import Colour
from realizer_studio.tracking.markers.layout import Layout, numbered, wojdel
from realizer_studio.tracking.markers.ordering import locate, nearest, order
from realizer_studio.tracking.markers.repair import normalised, repaired
from realizer_studio.tracking.network import TrackingError
from realizer_studio.tracking.person_recording import rate_of
from realizer_studio.tracking.pictures import Picture

if TYPE_CHECKING:
    from PIL.Image import Image

MERGED = 9.0  # pixels; the largest distance between the centres of blobs of one marker
SQUARE = np.ones((3, 3), bool)
X, Y, COLOUR = 0, 1, 2  # columns of blobs
Box = tuple[int, int, int, int]


def blobs(picture: Image, colours: Sequence[Colour], region: Box | None = None) -> Float64:
    """Return the blobs (n, 3) of a picture: x, y in pixels from the top left corner, and the colour, from 0.

    The position is the centroid (eq. 7.3), or, for the second colour, which is painted on the lids, the
    centre of the upper edge (eq. 7.4).

    Args:
        region: left, top, right and bottom of the part with markers; None for the whole picture.
    """
    left, top = region[:2] if region is not None else (0, 0)
    hsv = (picture.crop(region) if region is not None else picture).convert("HSV")
    parts = []
    for number, colour in enumerate(colours):
        positions = _blob_positions(colour.mask(hsv), upper_edge=number == 1)
        parts.append(
            np.column_stack([positions + np.array([left, top]), np.full(len(positions), float(number))])
        )
    return np.concatenate(parts)


def _blob_positions(mask: Bool, *, upper_edge: bool) -> Float64:
    """Return the positions (n, 2) of the blobs of a mask, with those of one marker merged."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return np.zeros((0, 2))
    top, left = int(rows[0]), int(columns[0])
    part = np.pad(mask[top : rows[-1] + 1, left : columns[-1] + 1], 1)
    # Erosion, then dilation, removes parts narrower than three pixels, and smooths borders.
    marks, count = ndimage.label(_dilated(~_dilated(~part)), SQUARE)
    y, x = np.nonzero(marks)
    label = marks[y, x] - 1
    sizes = np.bincount(label, minlength=count).astype(np.float64)
    middles = np.stack([np.bincount(label, values, count) / sizes for values in (x, y)], axis=1)
    edges = np.full(count, np.inf)
    np.minimum.at(edges, label, y)
    group = _groups(middles)
    total = np.bincount(group, sizes)
    positions = np.stack([np.bincount(group, sizes * axis) / total for axis in middles.T], axis=1)
    if upper_edge:
        positions[:, 1] = np.inf
        np.minimum.at(positions[:, 1], group, edges)
    return np.asarray(positions + (left - 1.0, top - 1.0))  # noqa: RUF005


def _dilated(mask: Bool) -> Bool:
    """Return a mask dilated by 3 x 3 pixels."""
    wide = np.pad(mask, 1)
    wide = wide[1:-1] | wide[:-2] | wide[2:]
    return np.asarray(wide[:, 1:-1] | wide[:, :-2] | wide[:, 2:])


def _groups(middles: Float64) -> Index:
    """Return the number (n,) of each blob's group."""
    near = np.linalg.norm(middles[:, None] - middles, axis=-1) < MERGED
    return np.asarray(connected_components(near, directed=False)[1], np.intp)


USUAL = 0.9  # quantile of the number of blobs that is taken as the number of markers
TRIED = 40  # pictures in which the layout is searched
GOOD = 0.12  # largest mean distance of markers from a fitting layout, relative to its size
UP = np.array([1.0, -1.0])  # from pictures (y down) to layouts (y up)
SIDES = ("left", "right", "up", "down")  # directions that are measurable from the front


@dataclass(frozen=True, eq=False)
class MarkerSettings:
    """The settings for tracking markers."""

    colours: Sequence[Colour]  # of the markers; the second one is the paint on the lids
    # Of the points, in any unit; None for Wojdel's 31 points if they fit, or else numbered points.
    layout: Layout | None = None
    region: Box | None = None  # left, top, right, bottom in pixels; None is the whole picture
    # Number of the picture with the face at rest; None to search one with all markers.
    neutral: int | None = None


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers at an even rate."""

    fps: float  # frames a second
    layout: Layout  # names, and positions at rest without the head's pose
    pixels: Float64  # (n, k, 2) x right, y down
    points: Float64  # (n, k, 2) without the head's position, size and roll; x to the person's left, y up
    visible: Bool  # (n, k) whether a point was seen; the others are repaired


def track_markers(
    pictures: Iterable[Picture], settings: MarkerSettings, where: str, fps: float | None = None
) -> Markers:
    """Return the markers in pictures.

    Args:
        where: name of the film in messages.
        fps: the rate of the result; None for that of the pictures.

    Raises:
        TrackingError: no markers, or markers that do not fit the layout.
    """
    times, found = [], []
    for picture in pictures:
        times.append(picture.time)
        found.append(blobs(picture.image, settings.colours, settings.region) * (*UP, 1.0))
    layout, start = _initial_layout(found, settings, where)
    positions = order(found, layout, start)
    rate = fps or rate_of(times)
    even_times = np.arange(int(times[-1] * rate + 1e-6) + 1) / rate
    complete = _resampled(repaired(positions), np.asarray(times), even_times)
    visible = np.isfinite(
        positions[np.searchsorted(np.asarray(times), even_times - 0.5 / rate).clip(0, len(times) - 1), :, 0]
    )
    rest = normalised(layout, np.concatenate([complete, layout.positions[None]]))
    return Markers(rate, layout.with_positions(rest[-1]), complete * UP, rest[:-1], visible)


def faps_of(markers: Markers, face: str = "default") -> tuple[Float64, Bool]:
    """Return the FAPs (n, 68) of feature points among the markers, and (68,) whether each FAP is measured.

    The layout at rest is fitted to the feature points of a face, which gives the unit of motion. Motion
    towards the camera is not measured.

    Raises:
        TrackingError: no feature points among the markers.
    """
    names = {name: k for k, name in enumerate(markers.layout.feature_points) if name}
    if len(names) < 2:
        raise TrackingError(
            "wanted two feature points of MPEG-4 or more among the markers, for FAPs; see --layout"
        )
    head = load_face(face)
    indices = list(names.values())
    positions = np.array([head.points[name] for name in names], np.float64)
    rest = markers.layout.positions[indices]
    a, b = rest - rest.mean(axis=0), positions[:, :2] - positions[:, :2].mean(axis=0)
    metres = float((a * b).sum() / max(np.square(a).sum(), 1e-12))
    moved = np.zeros((len(markers.points), len(indices), 3))
    moved[:, :, :2] = (markers.points[:, indices] - rest) * metres
    moved_points = {name: (positions + moved)[:, k] for k, name in enumerate(names)}
    values, observed = faps_from_points(moved_points, dict(zip(names, positions, strict=True)), head.fapu)
    measurable = np.array([row.direction in SIDES for row in fap_rows()])
    measurable[HEAD_COLUMNS] = False
    return np.where(measurable, values, 0.0).astype(np.float64), observed & measurable


def _initial_layout(found: Sequence[Float64], settings: MarkerSettings, where: str) -> tuple[Layout, int]:
    """Return the layout in pixels (y up), and the number of the picture where it was found."""
    counts = np.array([len(some) for some in found])
    usual = int(np.quantile(counts, USUAL, method="nearest")) if len(counts) else 0
    colours = ", ".join(colour.name for colour in settings.colours)
    if usual < 3:
        raise TrackingError(
            f"{where}: wanted markers of the colours {colours}, found {usual} in most pictures; "
            "click on some by --marker-at X,Y"
        )
    candidates = np.argsort(
        np.abs(counts - (len(settings.layout) if settings.layout is not None else usual)), kind="stable"
    )
    tried = [settings.neutral] if settings.neutral is not None else candidates[:TRIED].tolist()
    if not 0 <= tried[0] < len(found):
        raise TrackingError(
            f"{where}: wanted a picture from 0 to {len(found) - 1} as --neutral, got {tried[0]}"
        )
    candidate = settings.layout or (wojdel() if usual == len(wojdel()) else None)
    if candidate is not None:
        candidate = candidate.with_colours(len(settings.colours))
        fits = [(locate(candidate, found[k]), k) for k in tried]
        (positions, error), start = min(fits, key=lambda fit: fit[0][1])
        if positions is not None and error < GOOD * candidate.with_positions(positions).size:
            return candidate.with_positions(nearest(positions, candidate, found[start])), start
        if settings.layout is not None:
            raise TrackingError(
                f"{where}: wanted the {len(candidate)} markers of the layout, found {usual} of {colours} "
                "that do not lie like them; see --layout, --marker-at and --region"
            )
    start = tried[0]
    return numbered(found[start] * (*UP, 1.0)), start


def _resampled(positions: Float64, times: Float64, even_times: Float64) -> Float64:
    """Return positions (n, k, 2) interpolated at other times."""
    flat = positions.reshape(len(positions), -1)
    return np.stack([np.interp(even_times, times, coordinate) for coordinate in flat.T], axis=1).reshape(
        -1, *positions.shape[1:]
    )


def _csv(markers: Markers, face: str, name: str) -> str:
    rows = (
        [k, point, f"{x:.5f}", f"{y:.5f}", 0]
        for k, row in enumerate(markers.points)
        for point, (x, y) in zip(markers.layout.names, row.tolist(), strict=True)
        if np.isfinite(x)
    )
    return csv_text(["frame", "point", "x", "y", "z"], rows)


def _json(markers: Markers, face: str, name: str) -> str:
    content = {
        "fps": markers.fps,
        "frames": len(markers.points),
        "names": markers.layout.names,
        "feature_points": markers.layout.feature_points,
        "neutral": markers.layout.positions.round(5).tolist(),
        "points": markers.points.round(5).tolist(),
        "pixels": markers.pixels.round(2).tolist(),
        "seen": markers.visible.tolist(),
    }
    return json.dumps(content) + "\n"


def _clip(markers: Markers, face: str, name: str) -> FAPClip:
    return clip_of(*faps_of(markers, face), markers.fps, name)


# Suffix -> the text of markers, for a face, with a name.
FORMATS: Mapping[str, Callable[[Markers, str, str], str]] = {
    ".csv": _csv,
    ".json": _json,
    ".fap": lambda markers, face, name: encode(_clip(markers, face, name)),
    ".bml": lambda markers, face, name: document_of(_clip(markers, face, name), "tracked"),
}
