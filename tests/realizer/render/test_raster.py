"""Tests of the triangle rasterizer."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from realizer.face.drawn_mesh import CLOTH, EYE, DrawnMesh
from realizer.face.maps import Maps
from realizer.render.lamp_view import LampView
from realizer.render.raster import Raster
from realizer.render.shading import BRIGHTEST, STEPS, tone_curve
from realizer.render.textures import texels_of

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]

SIZE = (60, 40)
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
SEEN = 232  # the tone curve's byte of white light
LIGHTS = (
    np.zeros((2, 2, 3), np.float32),
    np.float32([[1, 1, 1]] + [[0, 0, 0]] * 8),
    np.zeros((5, 32, 32, 3), np.float32),
    np.float32(2),
    np.float32([1, 0.1]),
)


def raster_of(triangles, colours, size=SIZE, uv=None, maps=None, **flags):
    count, none = len(colours), np.zeros(len(triangles), bool)
    mesh = DrawnMesh(
        places=None, strands=None, ups=None,
        triangles=np.asarray(triangles, np.int32),
        uv=np.zeros((count, 2), np.float32) if uv is None else np.float32(uv),
        colours=np.zeros((count, 3), np.uint8),
        occlusion=np.ones(count, np.float32),
        gloss=np.zeros(count, np.float32),
        kind=np.full(count, flags.get("kind", CLOTH), np.uint8),
        parts={}, two_sided=flags.get("two_sided", none), see_through=flags.get("see_through", none),
    )  # fmt: skip
    lamp = LampView((0, 1, 1), (-1, -1, -1), (1, 1, 1))
    return Raster(size, mesh, np.float32(colours), maps or texels_of(None), lamp)


def picture_of(raster, points, near, eye=(0, 0, 100), pixel=0.01):
    """The picture of points (n, 2) in pixels, all facing the camera and far from the shadows' box."""
    points = np.asarray(points, float)
    moving = np.zeros((len(points), 10), np.float32)
    moving[:, :2], moving[:, 5] = points * (pixel, -pixel), 1
    return raster(points, near, moving, LIGHTS, np.float32(eye)).copy()


def draw(corners, colours, nearness=1.0, size=SIZE, **flags):
    """Triangles of (n, 3, 2) pixels, each of one colour and nearness."""
    corners = np.asarray(corners, float).reshape(-1, 2)
    count = len(corners) // 3
    tones = np.repeat(np.broadcast_to(colours, (count, 3)), 3, axis=0)
    near = np.repeat(np.broadcast_to(nearness, count), 3).astype(np.float32)
    return picture_of(raster_of(np.arange(3 * count).reshape(-1, 3), tones, size, **flags), corners, near)


BIG = [(5.0, 5.0), (5.0, 35.0), (55.0, 20.0)]  # counter-clockwise, seen with y up


def test_raster_covers_the_area_of_a_triangle():
    picture = draw([BIG], RED)
    assert picture[..., 3].sum() / 255 == pytest.approx(50 * 30 / 2, rel=0.01)
    assert picture[20, 20].tolist() == [SEEN, 0, 0, 255]
    assert picture[2, 2].tolist() == [0, 0, 0, 0]


def test_raster_leaves_out_triangles_seen_from_behind():
    assert not draw([BIG[::-1]], RED).any()


def test_raster_smooths_edges():
    assert len(np.unique(draw([BIG], RED)[..., 3])) == 5


def test_raster_hides_the_farther_in_either_order():
    pair = [BIG, BIG]
    for near, colours in (((1.0, 2.0), (BLUE, RED)), ((2.0, 1.0), (RED, BLUE))):
        assert draw(pair, colours, near)[20, 20].tolist() == [SEEN, 0, 0, 255]


def test_raster_leaves_no_gap_at_a_shared_edge():
    """A fan of thin triangles about one point: every sample inside belongs to one of them."""
    turn = np.linspace(0, 2 * np.pi, 48)
    rim = np.stack([30.3 + 18.1 * np.cos(turn), 20.7 - 18.1 * np.sin(turn)], axis=1)
    fan = [((30.3, 20.7), rim[k], rim[k + 1]) for k in range(len(rim) - 1)]
    picture = draw(fan, RED)
    y, x = np.mgrid[:40, :60] + 0.5
    inside = np.hypot(x - 30.3, y - 20.7) < 17
    assert (picture[inside] == (SEEN, 0, 0, 255)).all()


def test_raster_interpolates_colours():
    raster = raster_of([[0, 1, 2]], [[0, 0, 0], [0, 0, 0], [1, 1, 1]], (101, 50))
    points = np.array([[0.0, -60.0], [0.0, 110.0], [101.0, 25.0]])
    green = picture_of(raster, points, np.ones(3, np.float32))[25, :95, 1]
    steps = (np.sqrt((np.arange(95) + 0.5) / 101 / BRIGHTEST) * (STEPS - 1)).astype(int)
    assert green == pytest.approx(tone_curve()[steps], abs=1)


def test_raster_shows_sheets_from_behind():
    behind = draw([BIG[::-1]], RED, two_sided=np.ones(1, bool))
    assert np.array_equal(behind[20, 20], draw([BIG], RED)[20, 20])


def test_raster_cuts_holes_where_the_map_is_clear():
    albedo = np.full((64, 64, 4), 255, np.uint8)
    albedo[:, 32:, 3] = 0
    stream = io.BytesIO()
    Image.fromarray(albedo).save(stream, "webp", lossless=True)
    maps = Maps({"albedo": stream.getvalue()}, None, 0.0, 1.0, None, None)
    uv = [(0, 0), (0, 1), (1, 0.5)]
    raster = raster_of([[0, 1, 2]], [RED] * 3, uv=uv, maps=texels_of(maps), see_through=np.ones(1, bool))
    picture = picture_of(raster, BIG, np.ones(3, np.float32))
    assert picture[20, 20].tolist() == [SEEN, 0, 0, 255]
    assert not picture[:, 32:].any()


def webp(picture):
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "webp", lossless=True)
    return stream.getvalue()


def test_raster_shows_an_iris_below_the_cornea():
    albedo = np.zeros((64, 64, 3), np.uint8)
    albedo[:, 32:] = 255
    files = {"albedo": webp(albedo), "surface": webp(np.full((64, 64, 3), (255, 255, 0), np.uint8))}
    maps = texels_of(Maps(files, None, 0.0, 1.0, None, None))
    points = np.array([(0, 0), (0, 80), (80, 0)], float)
    edges = []
    for kind, eye in ((CLOTH, (90, 0, 0.1)), (EYE, (0, 0, 90)), (EYE, (90, 0, 0.1))):
        raster = raster_of([[0, 1, 2]], [(1, 1, 1)] * 3, (80, 80), points / 80, maps, kind=kind)
        row = picture_of(raster, points, np.ones(3, np.float32), eye, pixel=0.0005)[10, :60, 1]
        edges.append(int((row > 100).argmax()))
    # 3 mm below, light comes from 3.4 mm aside for an eye that looks along the surface.
    assert edges == [40, 40, 47]


def test_raster_cuts_triangles_at_the_picture_s_edges():
    huge = [(-500.0, -400.0), (-500.0, 900.0), (900.0, 20.0)]
    assert (draw([huge], BLUE) == (0, 0, SEEN, 255)).all()
    assert not draw([[(100.0, 5.0), (100.0, 35.0), (150.0, 20.0)]], BLUE).any()


def test_raster_leaves_out_what_is_not_a_number():
    broken = [(5.0, np.nan), (5.0, 35.0), (55.0, 20.0)]
    assert np.array_equal(draw([broken, BIG], RED), draw([BIG], RED))


def test_raster_forgets_the_picture_before():
    raster = raster_of([[0, 1, 2]], [RED] * 3)
    near = np.ones(3, np.float32)
    first = picture_of(raster, BIG, near)
    picture_of(raster, np.array(BIG) + 3, 5 * near)
    assert np.array_equal(picture_of(raster, BIG, near), first)


def test_raster_leaves_out_what_is_behind_the_lens():
    picture = draw([BIG, BIG], (RED, BLUE), (np.nan, 1.0))
    assert picture[20, 20].tolist() == [0, 0, SEEN, 255]
