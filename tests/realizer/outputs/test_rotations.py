"""Quaternions of head and eyes."""

import numpy as np

from realizer.outputs.rotations import half_turns, quaternions

TURNS = np.array([[0.3, -0.5, 0.1], [0, 1.2, 0], [0, 0, 0]], np.float32)


def test_quaternions_turn_up_by_positive_pitch_about_x():
    np.testing.assert_allclose(
        quaternions(np.float32([[np.pi / 2, 0, 0]])), [[0.5**0.5, 0, 0, 0.5**0.5]], atol=1e-6
    )


def test_half_turns_make_whole_turns_twice():
    half = half_turns(quaternions(TURNS)).astype(float)
    twice = np.concatenate([2 * half[:, 3:] * half[:, :3], 2 * half[:, 3:] ** 2 - 1], axis=1)
    np.testing.assert_allclose(twice, quaternions(TURNS), atol=1e-6)
