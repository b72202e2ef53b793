"""`light_band`: the light from what each sample sees."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.drawn_mesh import CLOTH, EYE
from realizer.face.maps import Maps
from realizer.render.shading import BRIGHTEST, STEPS, tone_curve
from realizer.render.textures import texels_of
from tests.realizer.render.rasters import BIG, RED, draw, picture_of, raster_of, webp

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]


def test_light_band_smooths_edges():
    assert len(np.unique(draw([BIG], RED)[..., 3])) == 5


def test_light_band_interpolates_colours():
    raster = raster_of([[0, 1, 2]], [[0, 0, 0], [0, 0, 0], [1, 1, 1]], (101, 50))
    points = np.array([[0.0, -60.0], [0.0, 110.0], [101.0, 25.0]])
    green = picture_of(raster, points, np.ones(3, np.float32))[25, :95, 1]
    steps = (np.sqrt((np.arange(95) + 0.5) / 101 / BRIGHTEST) * (STEPS - 1)).astype(int)
    assert green == pytest.approx(tone_curve()[steps], abs=1)


def test_light_band_darkens_the_ground_of_folds():
    heights = np.full((64, 64), 128, np.uint8)
    heights[:, 32:] = 0
    files = {"albedo": webp(np.full((64, 64, 3), 90, np.uint8)), "folds": webp(heights)}
    points = np.array([(0, 0), (0, 80), (80, 0)], float)
    maps = texels_of(Maps(files, None, 0.0, 1.0, None, None))
    raster = raster_of([[0, 1, 2]], [(1, 1, 1)] * 3, (80, 80), points / 80, maps)
    near = np.ones(3, np.float32)
    rows = [picture_of(raster, points, near, fold=fold)[10, :, 1].astype(int) for fold in (0, 0.5, 1)]
    assert len({int(row[20]) for row in rows}) == 1
    assert rows[0][55] > rows[1][55] + 10 > rows[2][55] + 20


def test_light_band_shows_an_iris_below_the_cornea():
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
