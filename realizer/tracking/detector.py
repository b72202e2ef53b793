"""The detector: regions of the faces in a picture."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float64
from realizer.tracking.network import network
from realizer.tracking.region import Region

if TYPE_CHECKING:
    from PIL.Image import Image

MODEL = "face_detection_short_range"
ANCHORS = ((16, 2), (8, 6))  # squares in a row of the picture, and anchors in the middle of each
MIN_SCORE = 0.5
MAX_OVERLAP = 0.3  # of two boxes of different faces, relative to their union
RIGHT_EYE, LEFT_EYE = 2, 3  # of the 8 points of a row: two corners of the box, then those of the face
MARGIN = 1.5  # of a region, relative to the box
TILE = 0.6  # of the picture; faces that the whole picture shows too small are searched in four such parts


def detect(picture: Image) -> list[Region]:
    """Return the region of each face, the most certain first."""
    width, height = picture.size
    side = max(width, height)
    found = _detect(picture, Region(width / 2, height / 2, side))
    if not found:
        part = side * TILE
        xs, ys = ({min(part, length) / 2, length - min(part, length) / 2} for length in (width, height))
        found = [
            face for y in sorted(ys) for x in sorted(xs) for face in _detect(picture, Region(x, y, part))
        ]
    return [
        Region.around(points[:2], points[RIGHT_EYE], points[LEFT_EYE], MARGIN)
        for _, points in _distinct(found)
    ]


def _detect(picture: Image, part: Region) -> list[tuple[float, Float64]]:
    """Return score and points (8, 2) of each face in a part of a picture, in pixels of the picture."""
    model = network(MODEL)
    outputs = model(part.cut(picture, model.size), low=-1.0)
    scores = 1 / (1 + np.exp(-np.clip(outputs["classificators"][0, :, 0].astype(np.float64), -100, 100)))
    likely = np.flatnonzero(scores >= MIN_SCORE)
    rows = outputs["regressors"][0, likely].reshape(-1, 8, 2).astype(np.float64) / model.size
    rows[:, [0, *range(2, 8)]] += _anchors()[likely, None]
    half = rows[:, 1] / 2
    rows[:, 1] = rows[:, 0] + half
    rows[:, 0] -= half
    return [(float(scores[k]), part.place(row)) for k, row in zip(likely, rows, strict=True)]


@cache
def _anchors() -> Float64:
    """Return the middles (896, 2) of the anchors, 0..1, in the order of the network."""
    places = []
    for count, each in ANCHORS:
        y, x = np.mgrid[:count, :count].reshape(2, -1)
        places.append(np.repeat((np.stack([x, y], axis=1) + 0.5) / count, each, axis=0))
    return np.concatenate(places)


def _distinct(found: list[tuple[float, Float64]]) -> list[tuple[float, Float64]]:
    """Merge the boxes of one face to their mean, weighted by score (non-maximum suppression)."""
    rest, faces = sorted(found, key=lambda face: -face[0]), []
    while rest:
        same = [face for face in rest if _overlap(face[1], rest[0][1]) > MAX_OVERLAP]
        rest = [face for face in rest if _overlap(face[1], rest[0][1]) <= MAX_OVERLAP]
        weights = np.array([score for score, _ in same])
        faces.append((same[0][0], np.average([points for _, points in same], axis=0, weights=weights)))
    return faces


def _overlap(one: Float64, other: Float64) -> float:
    """Return the intersection of two boxes, relative to their union."""
    shared = np.prod(np.clip(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]), 0, None))
    return float(shared / (np.prod(one[1] - one[0]) + np.prod(other[1] - other[0]) - shared))
