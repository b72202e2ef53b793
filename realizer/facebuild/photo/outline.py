"""The outline of a face in profile, before a plain background."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float64
from realizer.tracking.region import Region

if TYPE_CHECKING:
    from PIL.Image import Image

EDGE = 0.01  # of the width: the columns that the background is first measured in
FORGET = 0.04  # share of a column in the mean of the background, which may change slowly
APART = 26.0  # distance of colours, 0..441, from which on it is not the background
RUN = 4  # columns that differ one after the other
REACH = 0.6  # sides of the region, upwards and downwards


def outline(image: Image, region: Region) -> Float64:
    """Return the outermost points (n, 2) of a face that looks to the picture's right, from above downwards.

    Each row of the picture is followed from its right edge to where the background ends.
    """
    from scipy.ndimage import gaussian_filter, median_filter

    reach = REACH * region.side
    top, bottom = (int(np.clip(region.y + way * reach, 0, image.height - 1)) for way in (-1, 1))
    pixels = np.asarray(image, np.float32)[top : bottom + 1]
    pixels = gaussian_filter(pixels, (1, 1, 0))
    width = pixels.shape[1]
    background = pixels[:, -max(RUN, round(EDGE * width)) :].mean(axis=1)
    run, found = np.zeros(len(pixels), int), np.full(len(pixels), -1)
    for column in range(width - 1, -1, -1):
        here = pixels[:, column]
        differs = np.linalg.norm(here - background, axis=1) > APART
        run = np.where(differs, run + 1, 0)
        found = np.where((found < 0) & (run == RUN), column + RUN - 1, found)
        background += FORGET * ~differs[:, None] * (here - background)
    rows = np.flatnonzero(found >= 0)
    across = median_filter(found[rows].astype(float), 7, mode="nearest")
    return np.stack([across + 0.5, rows + top + 0.5], axis=1)
