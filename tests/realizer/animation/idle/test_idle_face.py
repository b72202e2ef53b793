"""The idle animation of a face is a function of seed, time and what moves its blinks."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES, au
from realizer.animation.blend import blend
from realizer.animation.fap.conversion import to_fap
from realizer.animation.idle.blinks import GazeShift, PhraseEnd
from realizer.animation.idle.idle_face import idle_face
from realizer.core.array_types import Float32, Float64

LIVELINESS = st.sampled_from((0.0, 0.5, 1.0))
ENDS, SHIFTS = (PhraseEnd(2.0, 3.1), PhraseEnd(2.0, 5.0)), (GazeShift(4.0, 50.0), GazeShift(7.0, 35.0))


def idle(times: Float64, seed: int = 0, liveliness: float = 0.0) -> Float32:
    face = idle_face(float(times[0]), float(times[-1]), seed, ENDS, liveliness=liveliness, shifts=SHIFTS)
    return blend([], times, idle=face).values


@given(
    st.integers(0, 2**40),
    LIVELINESS,
    st.floats(0, 20_000) | st.floats(0, 8),
    st.floats(0.1, 8),
    st.floats(0.1, 8),
)
def test_idle_face_agrees_in_overlapping_windows(
    seed: int, liveliness: float, begin: float, one: float, two: float
) -> None:
    times = begin + np.arange(0, one + two, 0.05)
    split = max(1, int(len(times) * one / (one + two)))
    whole = idle(times, seed, liveliness)
    np.testing.assert_array_equal(whole[:split], idle(times[:split], seed, liveliness))
    np.testing.assert_array_equal(
        whole[split:], idle(times[split:], seed, liveliness) if split < len(times) else whole[split:]
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


def test_idle_face_has_each_column_once() -> None:
    frames = blend([], np.arange(0, 20, 0.04), idle=idle_face(0, 20, 7))
    left, right = (frames.values[:, lid.column] for lid in au(45))
    assert left.max() == 1
    np.testing.assert_array_equal(left, right)
    moves = idle_face(0, 20, 7).motion.columns
    assert sorted(AU_NAMES()[column] for column in moves) == [
        str(n) for n in (*range(51, 57), *range(61, 65))
    ]


def test_idle_face_that_is_alive_breathes_and_drifts_but_slowly() -> None:
    times = np.arange(0, 300, 0.02)
    frames = blend([], times, idle=idle_face(0, 300, 1, liveliness=1.0))
    degrees = np.degrees(to_fap(frames).values[:, 47:50] * 1e-5)
    assert (degrees.std(axis=0) > 0.7).all()
    assert np.abs(degrees).max() < 6.0
    assert np.abs(np.diff(degrees, axis=0)).max() < 0.2  # 10 degrees a second
    names = dict(zip(AU_NAMES(), frames.before_rules.T, strict=True))
    for name in ("1L", "2R", "4L", "7R", "12L", "14R", "17"):
        assert 0.02 < names[name].max() < 0.4, name


def test_idle_face_scales_with_liveliness() -> None:
    times = np.arange(0, 60, 0.04)
    still, half, whole = (
        blend([], times, idle=idle_face(0, 60, 1, liveliness=part)).values[:, au(38)[0].column]
        for part in (0.0, 0.5, 1.0)
    )
    assert not still.any()
    np.testing.assert_allclose(half, whole / 2, atol=1e-6)
