"""Tests of locating points on the skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.render.surface_points import locate_on_skin

RIGHT, FRONT = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


def test_locate_on_skin_finds_the_near_side(balls):
    face, _ = balls
    places = np.array([[0.0, -0.03], [0.031, 0.02], [-0.02, -0.1]])
    corners, weights = locate_on_skin(face, places, RIGHT, FRONT, 1.0)
    points = (face.vertices[corners] * weights[..., None]).sum(axis=1)
    assert np.allclose(points[:, :2], places, atol=1e-6)
    assert (points[:, 2] > -0.09).all()
    assert np.allclose(weights.sum(axis=1), 1)


def test_locate_on_skin_turns_the_picture_from_aside(balls):
    face, _ = balls
    corners, weights = locate_on_skin(face, np.array([[0.09, -0.03]]), np.array([0, 0, -1.0]), RIGHT, 1.0)
    (point,) = (face.vertices[corners] * weights[..., None]).sum(axis=1)
    assert point == pytest.approx([0.075, -0.03, -0.09], abs=0.001)


def test_locate_on_skin_is_none_beside_or_on_coarse_skin(balls):
    face, _ = balls
    assert locate_on_skin(face, np.array([[0.0, 0.0], [0.3, 0.0]]), RIGHT, FRONT, 1.0) is None
    assert locate_on_skin(face, np.array([[0.0, -0.03]]), RIGHT, FRONT, 1e-4) is None
