"""Tests of the software backend."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.surface import normals
from realizer.render.cameras import camera_for
from realizer.render.light import preset
from realizer.render.software import SoftwareCanvas

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]

SIZE = (256, 256)


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
    picture = SoftwareCanvas(face, SIZE, camera, preset()).draw(*pose(face)).astype(int)
    for point in ("3.5", "3.6"):
        x, y = camera.project(face.points[point], SIZE)[0][0].round().astype(int)
        assert picture[y - 2 : y + 3, x - 2 : x + 3].sum(2).min() < 150
    x, y = camera.project(face.points["9.3"], SIZE)[0][0].round().astype(int)
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
