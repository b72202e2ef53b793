"""Tests of the outline of a face in profile."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from realizer.facebuild.photo.outline import outline
from realizer.tracking.region import Region


def test_outline_is_where_a_background_ends_that_changes_slowly() -> None:
    ramp = np.linspace(60, 140, 400)[None, :, None] + np.linspace(0, 20, 300)[:, None, None]
    image = Image.fromarray(np.repeat(ramp, 3, axis=2).astype(np.uint8))
    ImageDraw.Draw(image).ellipse((50, 50, 250, 250), fill=(220, 170, 150))
    line = outline(image, Region(150, 150, 160))
    wanted = 150 + np.sqrt(np.maximum(100**2 - (line[:, 1] - 150.5) ** 2, 0))
    assert len(line) > 150
    assert np.abs(line[:, 0] - wanted).max() < 6
    assert np.median(np.abs(line[:, 0] - wanted)) < 2


def test_outline_of_an_empty_wall_is_empty() -> None:
    assert outline(Image.new("RGB", (200, 200), "grey"), Region(100, 100, 100)).shape == (0, 2)
