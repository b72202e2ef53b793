"""Idle motion is a function of seed and time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer import tables
from realizer.animation.axis import AU_NAMES, au
from realizer.animation.blend import blend
from realizer.animation.fap.conversion import to_fap
from realizer.animation.idle.motion import idle_face
from realizer.core.array_types import Float32, Float64


def idle(times: Float64, seed: int = 0) -> Float32:
    return blend([], times, idle=idle_face(float(times[0]), float(times[-1]), seed)).values


@given(st.integers(0, 2**40), st.floats(0, 20_000), st.floats(0.1, 8), st.floats(0.1, 8))
def test_idle_face_agrees_in_overlapping_windows(seed: int, begin: float, one: float, two: float) -> None:
    times = begin + np.arange(0, one + two, 0.05)
    split = max(1, int(len(times) * one / (one + two)))
    whole = idle(times, seed)
    np.testing.assert_array_equal(whole[:split], idle(times[:split], seed))
    np.testing.assert_array_equal(
        whole[split:], idle(times[split:], seed) if split < len(times) else whole[split:]
    )


def test_idle_face_depends_on_the_seed() -> None:
    times = np.arange(0, 10, 0.04)
    assert not np.array_equal(idle(times, 0), idle(times, 1))


def test_idle_motion_is_small_and_smooth() -> None:
    times = np.arange(0, 60, 0.01)
    faps = to_fap(blend([], times, idle=idle_face(0, 60, 1))).values
    degrees = np.degrees(faps[:, 47:50] * 1e-5)
    assert 0.3 < np.abs(degrees).max() < 2.0
    assert np.abs(np.diff(degrees, axis=0)).max() < 0.1  # 10 degrees a second
    eyes = np.degrees(faps[:, 22:26] * 1e-5)
    assert 0.3 < np.abs(eyes).max() < 3.5


def test_idle_eyes_compensate_the_sway_of_the_head() -> None:
    times = np.arange(0, 60, 0.01)
    faps = to_fap(blend([], times, idle=idle_face(0, 60, 1))).values
    gaze = np.degrees((faps[:, 22] + faps[:, 48]) * 1e-5)
    still = np.abs(np.diff(gaze)) < 1e-3
    assert still.mean() > 0.9


def test_idle_eyes_move_in_saccades() -> None:
    motion = idle_face(0, 60, 1).motion
    still = np.zeros_like(motion.poses)
    eyes = replace(motion, poses=still, steps=still)  # a head that keeps still
    most = np.array([tables.by_number()[int(AU_NAMES()[column])].degrees for column in motion.columns[-4:]])
    for start, lasts in zip(motion.jumps[3:50], motion.durations[3:50], strict=True):
        times = start + lasts * np.arange(-0.25, 1.26, 0.05)
        degrees = (eyes.at(times)[-4:] * most[:, None]).reshape(2, 2, -1)
        gaze = degrees[:, 1] - degrees[:, 0]
        gone = np.hypot(*(gaze - gaze[:, :1]))
        way = float(gone[-1])
        assert lasts == pytest.approx(0.021 + 0.0022 * way)  # Carpenter 1988
        assert (gone[:6] < 1e-9).all()
        np.testing.assert_allclose(gone[25:], way, atol=1e-9)
        assert gone[15] == pytest.approx(way / 2)  # half-way at half of the time, on a straight line
        assert (np.diff(gone) > -1e-9).all()


def test_idle_face_has_each_column_once() -> None:
    frames = blend([], np.arange(0, 20, 0.04), idle=idle_face(0, 20, 7))
    left, right = (frames.values[:, lid.column] for lid in au(45))
    assert left.max() == 1
    np.testing.assert_array_equal(left, right)
    moves = idle_face(0, 20, 7).motion.columns
    assert sorted(AU_NAMES()[column] for column in moves) == [
        str(n) for n in (*range(51, 57), *range(61, 65))
    ]
