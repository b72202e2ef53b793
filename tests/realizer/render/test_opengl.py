"""Tests of the OpenGL backend, whose context lives in this process here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
import pytest

from realizer.render.cameras import camera_for
from realizer.render.light import preset
from realizer.render.opengl import OpenGLCanvas

pytestmark = [pytest.mark.gl("gl"), pytest.mark.xdist_group("render")]

SIZE = (320, 240)


@pytest.fixture(scope="module")
def canvases(balls) -> Iterator[Callable[[tuple[int, int]], OpenGLCanvas]]:
    """Canvases by size. To open one takes seconds, and to close one ends the display of the process."""
    face, _ = balls

    @cache
    def canvas_of(size: tuple[int, int]) -> OpenGLCanvas:
        return OpenGLCanvas(face, size, camera_for(face), preset())

    yield canvas_of
    canvas_of(SIZE).close()


@pytest.fixture
def canvas(canvases) -> OpenGLCanvas:
    return canvases(SIZE)


def skin(picture):
    """Where it is warm: the backdrop is blue-grey."""
    return picture[..., 0].astype(int) > picture[..., 2].astype(int) + 15


def test_opengl_canvas_draws_the_projected_silhouette(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    assert picture.shape == (240, 320, 3)
    rows, columns = np.nonzero(skin(picture))
    outline = camera_for(face).project(face.vertices, SIZE)[0]
    assert rows.min() == pytest.approx(outline[:, 1].min(), abs=2)
    assert rows.max() == pytest.approx(outline[:, 1].max(), abs=2)
    assert columns.min() == pytest.approx(outline[:, 0].min(), abs=2)
    assert columns.max() == pytest.approx(outline[:, 0].max(), abs=2)


def test_opengl_canvas_draws_the_eyes_where_they_project(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    for x, y in camera_for(face).project([[0.032, 0, 0], [-0.032, 0, 0]], SIZE)[0].round().astype(int):
        assert picture[y, x].min() > 170


def test_opengl_canvas_follows_the_vertices(canvas, balls):
    face, normals = balls
    still = canvas.draw(face.vertices, normals)
    moved = canvas.draw(face.vertices + np.float32([0.02, 0, 0]), normals)
    shift = camera_for(face).project([[0.02, 0, -0.05], [0, 0, -0.05]], SIZE)[0][:, 0]
    centre = [np.nonzero(skin(p))[1].mean() for p in (still, moved)]
    assert centre[1] - centre[0] == pytest.approx(shift[0] - shift[1], abs=1.5)
    assert np.array_equal(canvas.draw(face.vertices, normals), still)


def test_opengl_canvas_is_lit_from_the_upper_left(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals).astype(float).sum(2)
    where = skin(canvas.draw(face.vertices, normals))
    rows, columns = np.nonzero(where)
    left = columns < columns.mean()
    upper = rows < rows.mean()
    brightness = picture[rows, columns]
    assert brightness[left & upper].mean() > brightness[~left & upper].mean() + 20
    assert brightness[left & upper].mean() > brightness[left & ~upper].mean() + 20


def test_opengl_canvas_smooths_edges(canvas, balls):
    """MSAA x4: along the outline there are tones between skin and backdrop."""
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    row = picture[100, :, 0].astype(int)
    step = np.abs(np.diff(row))
    assert step.max() < 120
    between = canvas.draw(face.vertices + np.float32([0.0003, 0, 0]), normals)
    assert not np.array_equal(between, picture)


def test_opengl_canvas_has_a_soft_neutral_backdrop(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals).astype(int)
    corner, beside = picture[2, 2], picture[90, 40]
    assert (beside > corner).all()
    assert np.ptp(corner) < 20
    assert np.abs(np.diff(picture[:, 3].sum(1))).max() < 30


def test_opengl_canvas_draws_into_the_given_memory(canvas, balls):
    face, normals = balls
    out = np.zeros((240, 320, 3), np.uint8)
    assert canvas.draw(face.vertices, normals, out) is out
    assert np.array_equal(out, canvas.draw(face.vertices, normals))


def test_opengl_canvas_does_not_shear_odd_sizes(canvases, balls):
    """Rows of 3 x 101 bytes are no multiple of four, GL's default row alignment."""
    face, normals = balls
    picture = canvases((101, 77)).draw(face.vertices, normals)
    columns = np.nonzero(skin(picture))[1]
    assert columns.mean() == pytest.approx(50, abs=1)
