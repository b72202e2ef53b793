"""Tests of the picture of strands."""

import numpy as np
import pytest

from realizer.facebuild.hair.texture import STRIPS, hair_texture, place
from realizer.facebuild.skin.atlas import HAIR


def test_place_lies_in_the_corner_of_its_strip() -> None:
    uv = place("brow", np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert (uv >= HAIR[:2]).all()
    assert (uv <= HAIR[2:]).all()
    assert uv[1, 0] - uv[0, 0] == pytest.approx((STRIPS["brow"].last - STRIPS["brow"].first) * 0.125)


def test_hair_texture_is_dense_where_its_strip_says_so() -> None:
    picture = hair_texture(128)
    assert picture.shape == (128, 128, 4)
    middle = picture[64, :, 3] / 255
    cover = {name: middle[int(s.first * 128) : int(s.last * 128)].mean() for name, s in STRIPS.items()}
    assert cover["dense"] > 0.8 > cover["loose"] > cover["sparse"] > 0.1


def test_hair_texture_thins_out_to_the_tips() -> None:
    locks = hair_texture(128)[:, int(0.16 * 128) : int(0.32 * 128), 3].mean(axis=1)
    assert locks[127] < 20 < locks[100] < locks[60]
