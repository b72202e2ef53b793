"""Tests of the backdrop and compositing."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.errors import RenderError
from realizer.render.backdrop import backdrop, channels, colour_of, over
from realizer.render.light import preset


def test_backdrop_blends_from_the_middle_to_the_corners():
    light = preset()
    picture = backdrop((200, 100), light)
    assert np.abs(picture[45, 100, :3] / 255 - light.backdrop_middle).max() < 0.01
    assert np.abs(picture[99, 0, :3] / 255 - light.backdrop_edge).max() < 0.01
    assert (picture[..., 3] == 255).all()


def test_over_mixes_half_covered_pixels():
    behind = np.full((1, 3, 4), 200, np.uint8)
    behind[..., 3] = 255
    pixels = np.array([[[0, 0, 0, 0], [50, 50, 50, 128], [9, 8, 7, 255]]], np.uint8)
    out = np.zeros((1, 3, 3), np.uint8)
    assert over(pixels, behind, out) is out
    assert out[0].tolist() == [[200] * 3, [50 + 100] * 3, [9, 8, 7]]


def test_over_nothing_keeps_colours_and_alpha():
    pixels = np.array([[[0, 0, 0, 0], [50, 25, 100, 128], [9, 8, 7, 255]]], np.uint8)
    out = over(pixels, backdrop((3, 1), preset(), "transparent"), np.zeros((1, 3, 4), np.uint8))
    assert out[0].tolist() == [[0, 0, 0, 0], [100, 50, 199, 128], [9, 8, 7, 255]]


def test_backdrop_of_one_colour_fills_the_picture():
    assert (backdrop((4, 3), preset(), "#12ab00") == (0x12, 0xAB, 0x00, 255)).all()


@pytest.mark.parametrize("says", ["white", "#12345", "#12345g", "#123456 "])
def test_colour_of_refuses_what_is_no_colour(says):
    with pytest.raises(RenderError, match="wanted transparent or a colour such as #d8dde2"):
        colour_of(says)


def test_colour_of_reads_the_variable(monkeypatch):
    assert colour_of(None) is None
    monkeypatch.setenv("REALIZER_BACKGROUND", "transparent")
    assert colour_of(None) == "transparent"
    assert colour_of(None, alpha=False) is None
    assert colour_of("#ffffff") == "#ffffff"
    assert [channels(b) for b in (None, "#ffffff", "transparent")] == [3, 3, 4]
