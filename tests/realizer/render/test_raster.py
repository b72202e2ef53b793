"""Tests of the triangle rasterizer."""

from __future__ import annotations

import numpy as np
import pytest

from tests.realizer.render.rasters import BIG, RED, SIZE, draw, picture_of, raster_of

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]


def test_raster_draws_a_picture_of_its_size():
    for width, height in (SIZE, (1, 1), (3, 70)):
        assert draw([BIG], RED, size=(width, height)).shape == (height, width, 4)


def test_raster_forgets_the_picture_before():
    raster = raster_of([[0, 1, 2]], [RED] * 3)
    near = np.ones(3, np.float32)
    first = picture_of(raster, BIG, near)
    picture_of(raster, np.array(BIG) + 3, 5 * near)
    assert np.array_equal(picture_of(raster, BIG, near), first)
