"""A detector of faces in a picture."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float64
from realizer_studio.tracking.network import Region, network

if TYPE_CHECKING:
    from PIL.Image import Image

MODEL = "face_detection_short_range"
ANCHORS = ((16, 2), (8, 6))  # cells in a row of the picture, and anchors in the centre of each
MIN_SCORE = 0.5
SURE = 0.65  # score; less certain faces count only if no others are found
MAX_OVERLAP = 0.45  # of two boxes of different faces, relative to the smaller one
RIGHT_EYE, LEFT_EYE = 2, 3  # indices in the 8 points of a face, of which two are the corners of the box
MARGIN = 1.5  # of a region, relative to the box
# Sizes of overlapping tiles, relative to the picture, in which small faces are searched.
TILES = (0.6, 0.3)
CLOSER = 2.5  # side of the part in which a face is detected again, relative to its box


def detect(picture: Image, small: bool = True) -> list[Region]:
    """Return the region of each face, the most certain first.

    With `small`, small faces are searched too, which takes ten times as long; without it, tiles are searched
    only if no face is found in the whole picture.
    """
    width, height = picture.size
    side = max(width, height)
    found = _detect(picture, Region(width / 2, height / 2, side))
    for share in TILES if small else TILES[: not found]:
        part = side * share
        xs, ys = (_middles(length, part) for length in (width, height))
        found += [face for y in ys for x in xs for face in _detect(picture, Region(x, y, part))]
    near = _distinct([again for face in _distinct(found) for again in _refine(picture, face[1])])
    sure = [face for face in near if face[0] >= SURE] or near
    return [Region.around(points[:2], points[RIGHT_EYE], points[LEFT_EYE], MARGIN) for _, points in sure]


def _refine(picture: Image, points: Float64) -> list[tuple[float, Float64]]:
    """Return the face in an enlarged part around a box, or an empty list."""
    (x, y), side = points[:2].mean(axis=0), float(np.ptp(points[:2], axis=0).max())
    found = _detect(picture, Region(float(x), float(y), CLOSER * side))
    middle = points[:2].mean(axis=0)
    return [face for face in found if np.abs(face[1][:2].mean(axis=0) - middle).max() < side]


def _middles(length: float, part: float) -> Float64:
    """Return the centres of tiles that cover a length and overlap by at least a fifth."""
    if part >= length:
        return np.array([length / 2])
    count = math.ceil((length - part) / (0.8 * part)) + 1
    return np.linspace(part / 2, length - part / 2, count)


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
    return [(float(scores[k]), part.to_picture(row)) for k, row in zip(likely, rows, strict=True)]


@cache
def _anchors() -> Float64:
    """Return the centres (896, 2) of the anchors, 0..1, in the order of the network."""
    centres = []
    for count, each in ANCHORS:
        y, x = np.mgrid[:count, :count].reshape(2, -1)
        centres.append(np.repeat((np.stack([x, y], axis=1) + 0.5) / count, each, axis=0))
    return np.concatenate(centres)


def _distinct(found: list[tuple[float, Float64]]) -> list[tuple[float, Float64]]:
    """Merge the boxes of each face to their mean, weighted by score, ignoring boxes of parts of the face."""
    remaining, faces = sorted(found, key=lambda face: -face[0]), []
    while remaining:
        overlapping = [face for face in remaining if _overlap(face[1], remaining[0][1]) > MAX_OVERLAP]
        remaining = [face for face in remaining if _overlap(face[1], remaining[0][1]) <= MAX_OVERLAP]
        sizes = np.array([np.prod(points[1] - points[0]) for _, points in overlapping])
        weights = np.array([score for score, _ in overlapping]) * (sizes > sizes.max() / 2)
        faces.append(
            (overlapping[0][0], np.average([points for _, points in overlapping], axis=0, weights=weights))
        )
    return faces


def _overlap(one: Float64, other: Float64) -> float:
    """Return the intersection of two boxes, relative to the smaller one."""
    shared = np.prod(np.clip(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]), 0, None))
    return float(shared / min(np.prod(one[1] - one[0]), np.prod(other[1] - other[0])))
