"""The gradient behind the head, and pixels laid over it."""

from __future__ import annotations

import numpy as np

from realizer.render.backdrop import backdrop, over
from realizer.render.light import preset


def test_the_middle_has_the_light_s_own_colour_and_the_corners_the_other():
    light = preset()
    picture = backdrop((200, 100), light)
    assert np.abs(picture[45, 100, :3] / 255 - light.backdrop_middle).max() < 0.01
    assert np.abs(picture[99, 0, :3] / 255 - light.backdrop_edge).max() < 0.01
    assert (picture[..., 3] == 255).all()


def test_half_covered_pixels_are_half_of_each():
    behind = np.full((1, 3, 4), 200, np.uint8)
    behind[..., 3] = 255
    pixels = np.array([[[0, 0, 0, 0], [50, 50, 50, 128], [9, 8, 7, 255]]], np.uint8)
    out = np.zeros((1, 3, 3), np.uint8)
    assert over(pixels, behind, out) is out
    assert out[0].tolist() == [[200] * 3, [50 + 100] * 3, [9, 8, 7]]
