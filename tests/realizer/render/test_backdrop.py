"""Tests of the backdrop and compositing."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import RenderError
from realizer.render.backdrop import backdrop, background_of, channels, is_picture, over, read_picture
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
def test_background_of_refuses_what_is_no_colour_and_no_file(says):
    with pytest.raises(RenderError, match="wanted transparent, a colour such as #d8dde2, or a picture"):
        background_of(says)


@pytest.mark.parametrize("form", ["png", "jpeg", "webp"])
def test_backdrop_of_a_picture_covers_the_size(form, tmp_path):
    """Twice as wide as wanted: its middle half is seen, from red to green."""
    wide = np.zeros((40, 160, 3), np.uint8)
    wide[:, 40:80, 0] = wide[:, 80:120, 1] = 250
    path = str(tmp_path / f"wide.{form}")
    Image.fromarray(wide).save(path, quality=95)
    assert is_picture(background_of(path))
    seen = backdrop((60, 30), preset(), path).astype(int)
    assert seen.shape == (30, 60, 4)
    assert np.abs(seen[:, 5:25] - (250, 0, 0, 255)).max() < 9
    assert np.abs(seen[:, 35:55] - (0, 250, 0, 255)).max() < 9


def test_backdrop_shows_the_light_through_a_transparent_picture(tmp_path):
    path = str(tmp_path / "clear.png")
    Image.new("RGBA", (8, 8), (0, 0, 0, 0)).save(path)
    assert (backdrop((16, 12), preset(), path) == backdrop((16, 12), preset())).all()


def test_read_picture_refuses_what_is_broken_or_of_another_format(tmp_path):
    whole, cut, other = tmp_path / "whole.png", tmp_path / "cut.png", tmp_path / "other.gif"
    noise = np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)
    Image.fromarray(noise).save(whole)
    cut.write_bytes(whole.read_bytes()[:5000])
    Image.fromarray(noise).save(other)
    for path in (cut, other, tmp_path, tmp_path / "none.png"):
        with pytest.raises(RenderError, match="wanted a picture"):
            read_picture(str(path))


def test_background_of_reads_the_variable(monkeypatch):
    assert background_of(None) is None
    monkeypatch.setenv("REALIZER_BACKGROUND", "transparent")
    assert background_of(None) == "transparent"
    assert background_of(None, alpha=False) is None
    assert background_of("#ffffff") == "#ffffff"
    assert [channels(b) for b in (None, "#ffffff", "transparent")] == [3, 3, 4]
