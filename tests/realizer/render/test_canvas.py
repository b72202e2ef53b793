"""Tests of the shaded mesh of a frame."""

from __future__ import annotations

import numpy as np

from realizer.render.cameras import camera_for
from realizer.render.canvas import ShadedMesh
from realizer.render.light import Shader, preset


def test_shaded_mesh_has_the_lit_head_at_its_vertices(balls):
    face, ups = balls
    camera = camera_for(face)
    figure = ShadedMesh(face, camera, preset())
    moved = face.vertices + np.float32([0.01, 0, 0])
    figure.pose(moved, ups)
    shader = Shader(preset(), face.colours, face.occlusion, face.gloss, camera.towards)
    assert np.array_equal(figure.points[: len(moved)], moved)
    assert np.array_equal(figure.colours[: len(moved)], shader(ups))
    assert figure.triangles.max() < len(figure.points) == len(figure.colours)


def test_shaded_mesh_moves_glints_with_the_eyes(balls):
    face, ups = balls
    figure = ShadedMesh(face, camera_for(face), preset())
    before = figure.points[len(face.vertices) :].copy()
    figure.pose(face.vertices + np.float32([0, 0.02, 0]), ups)
    assert np.allclose(figure.points[len(face.vertices) :] - before, [0, 0.02, 0], atol=1e-5)
