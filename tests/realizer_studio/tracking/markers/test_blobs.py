"""Tests of `realizer_studio.tracking.markers.blobs`."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from realizer_studio.tracking.markers.blobs import blobs
from realizer_studio.tracking.markers.colours import named

COLOURS = (named("green"), named("blue"))


def picture(*boxes: tuple[int, int, int, int], blue: tuple[int, int, int, int] | None = None) -> Image.Image:
    image = Image.new("RGB", (200, 120), (196, 150, 125))
    pen = ImageDraw.Draw(image)
    for box in boxes:
        pen.rectangle(box, fill=(60, 190, 80))
    if blue is not None:
        pen.rectangle(blue, fill=(50, 80, 200))
    return image


def test_blobs_are_the_middles_of_markers() -> None:
    found = blobs(picture((10, 20, 16, 28), (100, 50, 106, 56)), COLOURS)
    assert found == pytest.approx(np.array([[13, 24, 0], [103, 53, 0]]))


def test_blobs_narrower_than_three_pixels_are_noise() -> None:
    assert len(blobs(picture((10, 20, 40, 21), (100, 50, 101, 70)), COLOURS)) == 0


def test_blobs_nearer_than_nine_pixels_are_one_marker() -> None:
    found = blobs(picture((10, 20, 12, 24), (17, 20, 19, 24), (40, 20, 44, 24), (49, 20, 53, 24)), COLOURS)
    assert found[:, 0] == pytest.approx([14.5, 42, 51])


def test_blobs_of_painted_lids_are_at_the_upper_edge() -> None:
    (lid,) = blobs(picture(blue=(50, 30, 70, 36)), COLOURS)
    assert lid == pytest.approx([60, 30, 1])


def test_blobs_outside_the_region_are_left_out() -> None:
    shown = picture((10, 20, 16, 28), (100, 50, 106, 56))
    assert blobs(shown, COLOURS, (60, 0, 200, 120)) == pytest.approx(np.array([[103, 53, 0]]))
    assert blobs(shown, COLOURS, (120, 0, 200, 120)).shape == (0, 3)
