"""Tests of what all backends share."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.render.cameras import camera_for
from realizer.render.canvas import Canvas
from realizer.render.light import preset


class Half(Canvas):
    """A canvas that draws a red left half, and keeps what it was to draw."""

    def _open(self):
        self.seen = None

    def _pixels(self):
        self.seen = self._moving.copy()
        picture = np.zeros((*self._size[::-1], 4), np.uint8)
        picture[:, : self._size[0] // 2] = 255, 0, 0, 255
        return picture

    def close(self):
        pass


def test_canvas_lays_the_head_over_its_background(balls):
    face, normals = balls
    picture = Half(face, (8, 6), camera_for(face), preset(), "#102030").draw(face.vertices, normals)
    assert (picture[:, :4] == (255, 0, 0)).all()
    assert (picture[:, 4:] == (0x10, 0x20, 0x30)).all()


def test_canvas_draws_a_transparent_background_with_alpha(balls):
    face, normals = balls
    out = np.zeros((6, 8, 4), np.uint8)
    canvas = Half(face, (8, 6), camera_for(face), preset(), "transparent")
    assert canvas.draw(face.vertices, normals, out) is out
    assert (out[:, :4, 3] == 255).all()
    assert not out[:, 4:].any()


def test_canvas_moves_the_drawn_vertices_with_the_face(balls):
    face, normals = balls
    canvas = Half(face, (8, 6), camera_for(face), preset())
    canvas.draw(face.vertices, normals)
    before = canvas.seen
    canvas.draw(face.vertices + np.float32([0, 0.01, 0]), normals)
    moved = canvas.seen - before
    assert moved[:, :3] == pytest.approx(np.broadcast_to([0, 0.01, 0], (len(moved), 3)), abs=1e-5)
    assert not moved[:, 3:].any()
    assert np.linalg.norm(before[:, 3:6], axis=1) == pytest.approx(1, abs=1e-4)
