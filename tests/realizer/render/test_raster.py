"""Tests of the triangle rasterizer."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.surface import normals
from realizer.render.cameras import camera_for
from realizer.render.light import preset
from realizer.render.raster import SoftwareCanvas
from tests.realizer.render.rasters import BIG, RED, SIZE, draw, picture_of, raster_of

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]
CANVAS = (256, 256)


def test_raster_draws_a_picture_of_its_size():
    for width, height in (SIZE, (1, 1), (3, 70)):
        assert draw([BIG], RED, size=(width, height)).shape == (height, width, 4)


def test_raster_forgets_the_picture_before():
    raster = raster_of([[0, 1, 2]], [RED] * 3)
    near = np.ones(3, np.float32)
    first = picture_of(raster, BIG, near)
    picture_of(raster, np.array(BIG) + 3, 5 * near)
    assert np.array_equal(picture_of(raster, BIG, near), first)


@pytest.fixture(scope="module")
def face():
    return load_face("default")


def pose(face, **faps):
    row = np.zeros((1, 68), np.float32)
    for name, value in faps.items():
        row[0, int(name[3:]) - 1] = value
    vertices = deform(face, row)
    return vertices[0], normals(face, vertices)[0]


def test_software_canvas_draws_points_where_they_project(face):
    camera = camera_for(face)
    picture = SoftwareCanvas(face, CANVAS, camera, preset()).draw(*pose(face)).astype(int)
    for point in ("3.5", "3.6"):
        x, y = camera.project(face.points[point], CANVAS)[0][0].round().astype(int)
        assert picture[y - 2 : y + 3, x - 2 : x + 3].sum(2).min() < 150
    x, y = camera.project(face.points["9.3"], CANVAS)[0][0].round().astype(int)
    red, _, blue = picture[y, x]
    assert red > blue + 30


def test_software_canvas_draws_into_the_given_memory(face):
    canvas = SoftwareCanvas(face, (64, 48), camera_for(face), preset())
    out = np.zeros((48, 64, 3), np.uint8)
    assert canvas.draw(*pose(face), out) is out
    assert np.array_equal(canvas.draw(*pose(face)), out)
    canvas.close()


def test_software_canvas_leaves_out_vertices_behind_the_lens(face):
    vertices, ups = pose(face)
    behind = vertices + np.float32([0, 0, 9])
    picture = SoftwareCanvas(face, (64, 48), camera_for(face), preset()).draw(behind, ups)
    assert not (picture[..., 0].astype(int) - picture[..., 2] > 10).any()
