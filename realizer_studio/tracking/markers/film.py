"""Markers of a film: found, ordered, repaired and without the motion of the head; and their files."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours.keyframes import document_of
from realizer.core.array_types import Bool, Float64
from realizer.face.load import load_face
from realizer.outputs.csv_table import csv_text
from realizer.outputs.fap_text import encode
from realizer.tables import HEAD_COLUMNS
from realizer.tables import faps as fap_rows
from realizer_studio.analysis.faps_from_points import faps_from_points
from realizer_studio.tracking.files import clip_of
from realizer_studio.tracking.markers.blobs import Box, blobs
from realizer_studio.tracking.markers.colours import Colour
from realizer_studio.tracking.markers.layout import Layout, numbered, wojdel
from realizer_studio.tracking.markers.ordering import locate, nearest, order
from realizer_studio.tracking.markers.repair import normalised, repaired
from realizer_studio.tracking.network import TrackingError
from realizer_studio.tracking.pictures import Picture
from realizer_studio.tracking.recording import rate_of

USUAL = 0.9  # of the pictures have at most as many blobs as there are markers
TRIED = 40  # pictures in which the face is looked for
GOOD = 0.12  # distance of markers from the layout that is taken for theirs, relative to its size
UP = np.array([1.0, -1.0])  # rows of pictures go down
SIDES = ("left", "right", "up", "down")  # what is seen from the front


@dataclass(frozen=True, eq=False)
class Look:
    """What markers look like."""

    colours: Sequence[Colour]  # of the markers; the second one is the paint on the lids
    # Of the points, in any unit; None: Wojdel's 31 points if they fit, or else numbers.
    layout: Layout | None = None
    region: Box | None = None  # left, top, right, bottom in pixels; None is the whole picture
    # Number of the picture that shows the face at rest; None looks for one with all markers.
    neutral: int | None = None


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers at an even rate."""

    fps: float  # frames a second
    layout: Layout  # names, and places at rest without the head's pose
    pixels: Float64  # (n, k, 2) x right, y down
    points: Float64  # (n, k, 2) without the head's place, size and roll; x to the person's left, y up
    seen: Bool  # (n, k) whether a point was seen; the others are repaired


def track_markers(pictures: Iterable[Picture], look: Look, where: str, fps: float | None = None) -> Markers:
    """Return the markers in pictures.

    Args:
        where: name of the film in messages.
        fps: the rate of the result; None takes that of the pictures.

    Raises:
        TrackingError: no markers, or others than those of the layout.
    """
    times, found = [], []
    for picture in pictures:
        times.append(picture.time)
        found.append(blobs(picture.image, look.colours, look.region) * (*UP, 1.0))
    layout, start = _at_rest(found, look, where)
    places = order(found, layout, start)
    rate = fps or rate_of(times)
    even = np.arange(int(times[-1] * rate + 1e-6) + 1) / rate
    whole = _at_times(repaired(places), np.asarray(times), even)
    there = np.isfinite(
        places[np.searchsorted(np.asarray(times), even - 0.5 / rate).clip(0, len(times) - 1), :, 0]
    )
    rest = normalised(layout, np.concatenate([whole, layout.places[None]]))
    return Markers(rate, layout.at(rest[-1]), whole * UP, rest[:-1], there)


def faps_of(markers: Markers, face: str = "default") -> tuple[Float64, Bool]:
    """Return the FAPs (n, 68) that feature points among the markers show, and which of the FAPs those are.

    The markers at rest are laid on the feature points of a face, whose units measure their motion. Motion
    towards the camera is not seen.

    Raises:
        TrackingError: no feature points among the markers.
    """
    names = {name: k for k, name in enumerate(markers.layout.feature_points) if name}
    if len(names) < 2:
        raise TrackingError(
            "wanted two feature points of MPEG-4 or more among the markers, for FAPs; see --layout"
        )
    head = load_face(face)
    shown = list(names.values())
    places = np.array([head.points[name] for name in names], np.float64)
    rest = markers.layout.places[shown]
    a, b = rest - rest.mean(axis=0), places[:, :2] - places[:, :2].mean(axis=0)
    metres = float((a * b).sum() / max(np.square(a).sum(), 1e-12))
    moved = np.zeros((len(markers.points), len(shown), 3))
    moved[:, :, :2] = (markers.points[:, shown] - rest) * metres
    now = {name: (places + moved)[:, k] for k, name in enumerate(names)}
    values, seen = faps_from_points(now, dict(zip(names, places, strict=True)), head.fapu)
    flat = np.array([row.direction in SIDES for row in fap_rows()])
    flat[HEAD_COLUMNS] = False
    return np.where(flat, values, 0.0).astype(np.float64), seen & flat


def _at_rest(found: Sequence[Float64], look: Look, where: str) -> tuple[Layout, int]:
    """Return the layout in pixels (y up), and the number of the picture where it lies there."""
    counts = np.array([len(some) for some in found])
    usual = int(np.quantile(counts, USUAL, method="nearest")) if len(counts) else 0
    colours = ", ".join(colour.name for colour in look.colours)
    if usual < 3:
        raise TrackingError(
            f"{where}: wanted markers of the colours {colours}, found {usual} in most pictures; "
            "click on some by --marker-at X,Y"
        )
    near = np.argsort(
        np.abs(counts - (len(look.layout) if look.layout is not None else usual)), kind="stable"
    )
    tried = [look.neutral] if look.neutral is not None else near[:TRIED].tolist()
    if not 0 <= tried[0] < len(found):
        raise TrackingError(
            f"{where}: wanted a picture from 0 to {len(found) - 1} as --neutral, got {tried[0]}"
        )
    known = look.layout or (wojdel() if usual == len(wojdel()) else None)
    if known is not None:
        known = known.with_colours(len(look.colours))
        fits = [(locate(known, found[k]), k) for k in tried]
        (placed, off), start = min(fits, key=lambda fit: fit[0][1])
        if placed is not None and off < GOOD * known.at(placed).size:
            return known.at(nearest(placed, known, found[start])), start
        if look.layout is not None:
            raise TrackingError(
                f"{where}: wanted the {len(known)} markers of the layout, found {usual} of {colours} that "
                "do not lie like them; see --layout, --marker-at and --region"
            )
    start = tried[0]
    return numbered(found[start] * (*UP, 1.0)), start


def _at_times(places: Float64, times: Float64, even: Float64) -> Float64:
    """Return places (n, k, 2) at other times."""
    flat = places.reshape(len(places), -1)
    return np.stack([np.interp(even, times, way) for way in flat.T], axis=1).reshape(-1, *places.shape[1:])


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
        "neutral": markers.layout.places.round(5).tolist(),
        "points": markers.points.round(5).tolist(),
        "pixels": markers.pixels.round(2).tolist(),
        "seen": markers.seen.tolist(),
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
