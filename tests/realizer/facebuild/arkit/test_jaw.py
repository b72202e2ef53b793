"""Tests of the jaw's joint, found from the shape of an opening jaw."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.arkit.jaw import drag_of, joint_of

JOINT = np.array([0.0, -0.03, -0.07])
AT = np.random.default_rng(2).uniform((-0.05, -0.10, -0.03), (0.05, -0.05, 0.05), (200, 3))


def opened(radians: float) -> np.ndarray:
    """(n, 3) what a turn of a jaw by that angle does, in metres."""
    y, z = (AT - JOINT)[:, 1:].T
    cos, sin = np.cos(radians) - 1, np.sin(radians)
    return np.stack([0 * y, y * cos - z * sin, y * sin + z * cos], 1)


@pytest.mark.parametrize("radians", [0.1, 0.4])
def test_joint_is_where_the_shape_turns(radians: float) -> None:
    place, found = joint_of(AT, opened(radians), JOINT + np.array([0, 0.01, 0.01]), 0.06)
    assert found
    assert place == pytest.approx(JOINT, abs=1e-6)


def test_joint_is_the_usual_one_where_the_shape_does_not_turn() -> None:
    usual = np.array([0.0, -0.02, -0.06])
    for move in (np.zeros_like(AT), np.tile([0, -0.01, 0.0], (len(AT), 1)), opened(-0.2)):
        place, found = joint_of(AT, move, usual, 0.06)
        assert not found
        assert place is usual
    far = JOINT + np.array([0, 0.06, 0])
    assert joint_of(AT, opened(0.2), far, 0.06) == (pytest.approx(far), False)


def test_drag_is_the_share_of_the_chin_s_turn() -> None:
    share = np.linspace(0, 1.2, len(AT))
    chin = len(AT) // 2
    drag = drag_of(AT, opened(0.05) * share[:, None], JOINT, chin)
    assert drag[chin] == pytest.approx(1)
    assert drag == pytest.approx(np.clip(share / share[chin], 0, 1), abs=0.01)
