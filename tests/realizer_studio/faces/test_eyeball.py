"""Tests of generated eyeballs."""

import numpy as np
import pytest

from realizer_studio.faces.eyeball import CORNEA, LIMBUS, PUPIL, cornea, eyeball
from realizer_studio.faces.parts import Part

CENTRE, RADIUS, SQUARE = np.array([0.03, 0, 0]), 0.014, (0.5, 0.5, 1.0, 1.0)


@pytest.fixture(scope="module")
def left() -> Part:
    return eyeball("left_eye", CENTRE, RADIUS, SQUARE, 29, 1.0)


def test_eyeball_is_a_ball_with_a_smaller_ball_for_a_cornea(left: Part) -> None:
    away = left.vertices - CENTRE
    before = away - [0, 0, cornea(RADIUS)[0]]
    out = np.hypot(*away.T[:2])
    far = (out > LIMBUS + 1e-9) | (away[:, 2] < 0)
    assert np.linalg.norm(away[far], axis=1) == pytest.approx(RADIUS)
    assert np.linalg.norm(before[~far], axis=1) == pytest.approx(CORNEA)


def test_eyeball_looks_out(left: Part) -> None:
    a, b, c = (left.vertices[left.triangles[:, k]] for k in range(3))
    ways = np.cross(b - a, c - a)
    assert ((ways * (a + b + c - 3 * CENTRE)).sum(axis=1) > 0).all()


def test_eyeball_has_its_limbus_half_way_out_in_the_maps(left: Part) -> None:
    assert left.uv is not None
    out = np.hypot(*(left.vertices - CENTRE).T[:2])
    limbus = np.isclose(out, LIMBUS) & (left.vertices[:, 2] > 0)
    assert limbus.sum() == 32
    assert np.hypot(*(left.uv[limbus] - 0.75).T) == pytest.approx(0.125)
    assert left.uv.min() >= 0.5
    assert left.uv.max() <= 1.0


def test_eyeballs_have_their_temples_at_the_right_of_the_map(left: Part) -> None:
    right = eyeball("right_eye", -CENTRE, RADIUS, SQUARE, 30, -1.0)
    for ball, side in ((left, 1), (right, -1)):
        assert ball.uv is not None
        across = (ball.vertices[:, 0] - side * CENTRE[0]) * side
        assert np.corrcoef(across, ball.uv[:, 0])[0, 1] > 0.7
        assert np.corrcoef(ball.vertices[:, 1], ball.uv[:, 1])[0, 1] < -0.7


def test_pupil_grows_by_half_at_each_edge_along_the_cornea(left: Part) -> None:
    moves, away = left.fields[29], left.vertices - CENTRE
    out = np.hypot(*away.T[:2])
    edge = np.isclose(out, PUPIL)
    assert np.hypot(*moves[edge].T[:2]) == pytest.approx(0.5)
    assert moves[out > LIMBUS - 1e-9] == pytest.approx(0)
    wide = away + 0.001 * moves - [0, 0, cornea(RADIUS)[0]]
    front = (out < LIMBUS) & (away[:, 2] > 0)
    assert np.linalg.norm(wide[front], axis=1) == pytest.approx(CORNEA, abs=3e-5)
