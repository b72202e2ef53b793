"""Blobs: connected pixels of a marker's colour (Wojdel 2005, 7.1.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Bool, Float64, Index
from realizer_studio.tracking.markers.colours import Colour

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
    from scipy import ndimage

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
    from scipy.sparse.csgraph import connected_components

    near = np.linalg.norm(middles[:, None] - middles, axis=-1) < MERGED
    return np.asarray(connected_components(near, directed=False)[1], np.intp)
