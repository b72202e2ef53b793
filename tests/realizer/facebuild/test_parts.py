"""Tests of the parts of a face that is being built, and of generated eyeballs."""

import numpy as np
import pytest

from realizer.facebuild.parts import IRIS, eyeball, smooth

LOOK = {
    name: [float(k)] * 3
    for k, name in enumerate(("pupil", "iris_inner", "iris_middle", "iris_outer", "ring", "white", "corner"))
}


def test_eyeball_is_a_ball_whose_pupil_grows_by_half_at_each_edge() -> None:
    centre = np.array([0.03, 0, 0])
    ball = eyeball("left_eye", centre, 0.012, LOOK, -1.0)
    away = ball.vertices - centre
    assert np.linalg.norm(away, axis=1) == pytest.approx(0.012)
    moves = np.linalg.norm(ball.fields[29], axis=1)
    assert moves.max() == pytest.approx(0.5)
    white = np.hypot(away[:, 0], away[:, 1]) > 1.1 * IRIS / 1000
    assert not moves[white].any()


def test_part_subset_takes_its_fields_along() -> None:
    ball = eyeball("right_eye", np.zeros(3), 0.012, LOOK, 1.0)
    few = ball.subset(np.array([3, 1]), np.zeros((0, 3), np.int32))
    assert np.array_equal(few.vertices, ball.vertices[[3, 1]])
    assert np.array_equal(few.fields[30], ball.fields[30][[3, 1]])


def test_smooth_rises_and_falls_between_its_ends() -> None:
    assert smooth([0.0, 1.5, 3.0], 1, 2).tolist() == [0, 0.5, 1]
    assert smooth([0.0, 1.5, 3.0], 2, 1).tolist() == [1, 0.5, 0]
