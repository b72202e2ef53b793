"""Tests of the picture of strands."""

import numpy as np
import pytest

from realizer.facebuild.hair.texture import STRIPS, hair_texture, place
from realizer.facebuild.skin.atlas import HAIR


def test_place_lies_in_its_strip_of_the_corner() -> None:
    (u, v), (right, bottom) = place("brow", np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    strip = STRIPS["brow"]
    assert (right - u, HAIR.right - u) == pytest.approx(
        ((strip.right - strip.left) * 0.125, (1 - strip.left) * 0.125)
    )
    assert HAIR.top + strip.top * 0.125 < v < bottom < HAIR.top + strip.bottom * 0.125


def cover(picture: np.ndarray, name: str) -> np.ndarray:
    """Return the alpha 0..1 of each row of a strip, from root to tip."""
    strip, size = STRIPS[name], len(picture)
    top, bottom, left, right = (int(s * size) for s in (strip.top, strip.bottom, strip.left, strip.right))
    return np.asarray(picture[top:bottom, left:right, 3].mean(axis=1) / 255)


def test_hair_texture_is_as_dense_as_its_strips_say() -> None:
    picture = hair_texture(256)
    assert picture.shape == (256, 256, 4)
    dense, loose, wisps, sparse = (
        cover(picture, name)[20:60].mean() for name in ("dense", "loose", "wisps", "sparse")
    )
    assert dense > 0.7 > loose > 0.3
    assert wisps > sparse > 0.1


def test_hair_texture_thins_out_to_the_tips() -> None:
    locks = cover(hair_texture(256), "locks")
    assert locks[-1] < 0.1 < locks[200] < locks[120]
