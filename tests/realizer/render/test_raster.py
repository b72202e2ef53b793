"""Tests of the triangle rasterizer."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.render.raster import Raster

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]

SIZE = (60, 40)
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def draw(corners, colours, nearness=1.0, size=SIZE):
    """Triangles of (n, 3, 2) pixels, each of one colour and nearness."""
    corners = np.asarray(corners, float).reshape(-1, 2)
    count = len(corners) // 3
    tones = np.repeat(np.broadcast_to(colours, (count, 3)), 3, axis=0).astype(np.float32)
    near = np.repeat(np.broadcast_to(nearness, count), 3).astype(np.float32)
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    return Raster(size)(corners, near, triangles, tones).copy()


BIG = [(5.0, 5.0), (5.0, 35.0), (55.0, 20.0)]  # counter-clockwise, seen with y up


def test_raster_covers_the_area_of_a_triangle():
    picture = draw([BIG], RED)
    assert picture[..., 3].sum() / 255 == pytest.approx(50 * 30 / 2, rel=0.01)
    assert picture[20, 20].tolist() == [255, 0, 0, 255]
    assert picture[2, 2].tolist() == [0, 0, 0, 0]


def test_raster_leaves_out_triangles_seen_from_behind():
    assert not draw([BIG[::-1]], RED).any()


def test_raster_smooths_edges():
    assert len(np.unique(draw([BIG], RED)[..., 3])) == 5


def test_raster_hides_the_farther_in_either_order():
    pair = [BIG, BIG]
    for near, colours in (((1.0, 2.0), (BLUE, RED)), ((2.0, 1.0), (RED, BLUE))):
        assert draw(pair, colours, near)[20, 20].tolist() == [255, 0, 0, 255]


def test_raster_leaves_no_gap_at_a_shared_edge():
    """A fan of thin triangles about one point: every sample inside belongs to one of them."""
    turn = np.linspace(0, 2 * np.pi, 48)
    rim = np.stack([30.3 + 18.1 * np.cos(turn), 20.7 - 18.1 * np.sin(turn)], axis=1)
    fan = [((30.3, 20.7), rim[k], rim[k + 1]) for k in range(len(rim) - 1)]
    picture = draw(fan, RED)
    y, x = np.mgrid[:40, :60] + 0.5
    inside = np.hypot(x - 30.3, y - 20.7) < 17
    assert (picture[inside] == (255, 0, 0, 255)).all()


def test_raster_interpolates_colours():
    raster = Raster((101, 50))
    points = np.array([[0.0, -60.0], [0.0, 110.0], [101.0, 25.0]])
    tones = np.array([[0, 0, 0], [0, 0, 0], [1, 1, 1]], np.float32)
    picture = raster(points, np.ones(3, np.float32), np.array([[0, 1, 2]], np.int32), tones)
    assert picture[25, :95, 1].astype(int) == pytest.approx(255 * (np.arange(95) + 0.5) / 101, abs=1.5)


def test_raster_cuts_triangles_at_the_picture_s_edges():
    huge = [(-500.0, -400.0), (-500.0, 900.0), (900.0, 20.0)]
    assert (draw([huge], BLUE) == (0, 0, 255, 255)).all()
    assert not draw([[(100.0, 5.0), (100.0, 35.0), (150.0, 20.0)]], BLUE).any()


def test_raster_leaves_out_what_is_not_a_number():
    broken = [(5.0, np.nan), (5.0, 35.0), (55.0, 20.0)]
    assert np.array_equal(draw([broken, BIG], RED), draw([BIG], RED))


def test_raster_forgets_the_picture_before():
    raster = Raster(SIZE)
    points, near = np.array(BIG), np.ones(3, np.float32)
    triangles = np.array([[0, 1, 2]], np.int32)
    first = raster(points, near, triangles, np.ones((3, 3), np.float32)).copy()
    raster(points + 3, 5 * near, triangles, np.ones((3, 3), np.float32))
    assert np.array_equal(raster(points, near, triangles, np.ones((3, 3), np.float32)), first)


def test_raster_leaves_out_what_is_behind_the_lens():
    picture = draw([BIG, BIG], (RED, BLUE), (np.nan, 1.0))
    assert picture[20, 20].tolist() == [0, 0, 255, 255]
