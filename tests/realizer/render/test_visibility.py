"""`fill`: which triangle each sample of a picture sees."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.maps import Maps
from realizer.render.textures import texels_of
from tests.realizer.render.rasters import BIG, BLUE, RED, SEEN, draw, picture_of, raster_of, webp

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]


def test_fill_covers_the_area_of_a_triangle():
    picture = draw([BIG], RED)
    assert picture[..., 3].sum() / 255 == pytest.approx(50 * 30 / 2, rel=0.01)
    assert picture[20, 20].tolist() == [SEEN, 0, 0, 255]
    assert picture[2, 2].tolist() == [0, 0, 0, 0]


def test_fill_leaves_out_triangles_seen_from_behind():
    assert not draw([BIG[::-1]], RED).any()


def test_fill_hides_the_farther_in_either_order():
    pair = [BIG, BIG]
    for near, colours in (((1.0, 2.0), (BLUE, RED)), ((2.0, 1.0), (RED, BLUE))):
        assert draw(pair, colours, near)[20, 20].tolist() == [SEEN, 0, 0, 255]


def test_fill_leaves_no_gap_at_a_shared_edge():
    """A fan of thin triangles about one point: every sample inside belongs to one of them."""
    turn = np.linspace(0, 2 * np.pi, 48)
    rim = np.stack([30.3 + 18.1 * np.cos(turn), 20.7 - 18.1 * np.sin(turn)], axis=1)
    fan = [((30.3, 20.7), rim[k], rim[k + 1]) for k in range(len(rim) - 1)]
    picture = draw(fan, RED)
    y, x = np.mgrid[:40, :60] + 0.5
    inside = np.hypot(x - 30.3, y - 20.7) < 17
    assert (picture[inside] == (SEEN, 0, 0, 255)).all()


def test_fill_shows_sheets_from_behind():
    behind = draw([BIG[::-1]], RED, two_sided=np.ones(1, bool))
    assert np.array_equal(behind[20, 20], draw([BIG], RED)[20, 20])


def test_fill_cuts_holes_where_the_map_is_clear():
    albedo = np.full((64, 64, 4), 255, np.uint8)
    albedo[:, 32:, 3] = 0
    maps = Maps({"albedo": webp(albedo)}, None, 0.0, 1.0, None, None)
    uv = [(0, 0), (0, 1), (1, 0.5)]
    raster = raster_of([[0, 1, 2]], [RED] * 3, uv=uv, maps=texels_of(maps), see_through=np.ones(1, bool))
    picture = picture_of(raster, BIG, np.ones(3, np.float32))
    assert picture[20, 20].tolist() == [SEEN, 0, 0, 255]
    assert not picture[:, 32:].any()


def test_fill_cuts_triangles_at_the_picture_s_edges():
    huge = [(-500.0, -400.0), (-500.0, 900.0), (900.0, 20.0)]
    assert (draw([huge], BLUE) == (0, 0, SEEN, 255)).all()
    assert not draw([[(100.0, 5.0), (100.0, 35.0), (150.0, 20.0)]], BLUE).any()


def test_fill_leaves_out_what_is_not_a_number():
    broken = [(5.0, np.nan), (5.0, 35.0), (55.0, 20.0)]
    assert np.array_equal(draw([broken, BIG], RED), draw([BIG], RED))


def test_fill_leaves_out_what_is_behind_the_lens():
    picture = draw([BIG, BIG], (RED, BLUE), (np.nan, 1.0))
    assert picture[20, 20].tolist() == [0, 0, SEEN, 255]
