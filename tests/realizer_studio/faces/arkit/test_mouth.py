"""Tests of the coordinates around the mouth, on a flat face."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.mesh_geometry import grid
from realizer_studio.faces.arkit.mouth import Mouth, drag_of, joint_of, mouth_of

X, Y = np.meshgrid(np.arange(-20, 21) * 0.002, np.arange(-15, 16) * 0.002)
AT = np.stack([X.ravel(), Y.ravel(), np.zeros(X.size)], 1)
HIGH = {"2.2": 0.002, "2.6": 0.002, "2.7": 0.002, "2.3": -0.002, "2.8": -0.002, "2.9": -0.002,
        "8.1": 0.01, "8.5": 0.008, "8.6": 0.008, "8.2": -0.01, "8.7": -0.008, "8.8": -0.008}  # fmt: skip
ASIDE = {"2.6": 0.01, "2.8": 0.01, "2.4": 0.02, "8.5": 0.01, "8.7": 0.01, "8.3": 0.024,
         "2.7": -0.01, "2.9": -0.01, "2.5": -0.02, "8.6": -0.01, "8.8": -0.01, "8.4": -0.024}  # fmt: skip
POINTS = {name: (ASIDE.get(name, 0.0), HIGH.get(name, 0.0), 0.0) for name in {*HIGH, *ASIDE}}


@pytest.fixture(scope="module")
def mouth() -> Mouth:
    return mouth_of(AT, grid(*X.shape), POINTS, np.flatnonzero(AT[:, 1] > 0).astype(np.int32))


def test_mouth_knots_sum_to_one(mouth: Mouth) -> None:
    assert np.allclose(mouth.knots.sum(axis=0), 1)


def test_mouth_along_is_one_at_the_corners_and_grows_to_the_left(mouth: Mouth) -> None:
    along = mouth.along[np.isclose(AT[:, 1], 0.024)]
    assert (np.diff(along) >= -1e-9).all()
    assert along[[0, -1]] == pytest.approx([-1, 1])
    assert np.allclose(mouth.along, -mouth.along.reshape(X.shape)[:, ::-1].ravel(), atol=0.05)


def test_mouth_outer_runs_from_the_inner_to_the_outer_contour(mouth: Mouth) -> None:
    column = np.flatnonzero((AT[:, 0] == 0) & (AT[:, 1] >= 0.002) & (AT[:, 1] <= 0.01))
    outer = mouth.outer[column]
    assert outer[0] == pytest.approx(0)
    assert outer[-1] == pytest.approx(1)
    assert (np.diff(outer) > 0).all()
    assert mouth.outer.min() >= 0
    assert mouth.outer.max() <= 1


def test_mouth_away_counts_metres_over_the_skin(mouth: Mouth) -> None:
    vertex = int(np.argmin(np.linalg.norm(AT - [0, 0.026, 0], axis=1)))
    assert mouth.distance[vertex] == pytest.approx(0.016, rel=0.05)
    assert mouth.distance[np.argmin(np.linalg.norm(AT - [0, 0.01, 0], axis=1))] == 0


def test_mouth_upper_is_sharp_at_the_lips_and_soft_beside_them(mouth: Mouth) -> None:
    near = mouth.distance < 0.004
    assert set(np.unique(mouth.upper[near])) == {0.0, 1.0}
    assert (mouth.upper[near] == (AT[near, 1] > 0)).all()
    beside = mouth.upper[(np.abs(AT[:, 0]) > 0.036) & (AT[:, 1] == 0)]
    assert ((beside > 0.1) & (beside < 0.9)).all()


JOINT = np.array([0.0, -0.03, -0.07])
BONE = np.random.default_rng(2).uniform((-0.05, -0.10, -0.03), (0.05, -0.05, 0.05), (200, 3))


def opened(radians: float) -> np.ndarray:
    """(n, 3) what a turn of a jaw by that angle does, in metres."""
    y, z = (BONE - JOINT)[:, 1:].T
    cos, sin = np.cos(radians) - 1, np.sin(radians)
    return np.stack([0 * y, y * cos - z * sin, y * sin + z * cos], 1)


@pytest.mark.parametrize("radians", [0.1, 0.4])
def test_joint_is_where_the_shape_turns(radians: float) -> None:
    place, found = joint_of(BONE, opened(radians), JOINT + np.array([0, 0.01, 0.01]), 0.06)
    assert found
    assert place == pytest.approx(JOINT, abs=1e-6)


def test_joint_is_the_usual_one_where_the_shape_does_not_turn() -> None:
    usual = np.array([0.0, -0.02, -0.06])
    for move in (np.zeros_like(BONE), np.tile([0, -0.01, 0.0], (len(BONE), 1)), opened(-0.2)):
        place, found = joint_of(BONE, move, usual, 0.06)
        assert not found
        assert place is usual
    far = JOINT + np.array([0, 0.06, 0])
    assert joint_of(BONE, opened(0.2), far, 0.06) == (pytest.approx(far), False)


def test_drag_is_the_share_of_the_chin_s_turn() -> None:
    share = np.linspace(0, 1.2, len(BONE))
    chin = len(BONE) // 2
    drag = drag_of(BONE, opened(0.05) * share[:, None], JOINT, chin)
    assert drag[chin] == pytest.approx(1)
    assert drag == pytest.approx(np.clip(share / share[chin], 0, 1), abs=0.01)
