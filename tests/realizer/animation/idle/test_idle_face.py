"""The idle animation of a face is a function of seed, time and what moves its blinks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES, Target, au, mask_channel
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.conversion import to_fap
from realizer.animation.idle.blinks import GazeShift, PhraseEnd
from realizer.animation.idle.idle_face import idle_face, idle_layer, lids
from realizer.animation.idle.life import face_columns
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


def still(target: Target, value: float, layer: Layer) -> Channel:
    return Channel(target, np.zeros(1), np.array([value]), layer=layer, keeps_last=True)


@pytest.mark.parametrize("mask", ["life", "motion"])
def test_idle_layer_masks_the_slow_motion_of_a_living_face(mask: str) -> None:
    times, idle = np.arange(0, 20, 0.04), idle_face(0.0, 20.0, 3, liveliness=1.0)
    columns = [au(number)[0].column for number in (1, 2, 12, 38)]
    masked = still(mask_channel(mask), 1.0, Layer.BASE)
    assert blend([], times, idle=idle).values[:, columns].any(axis=0).all()
    assert not blend([masked], times, idle=idle).values[:, columns].any()


def gaze_of(*masks: Channel) -> tuple[Float64, Float64]:
    """Return yaw and pitch of the eyes over a minute, without the head's motion; left and up are positive."""
    times, idle = np.arange(0, 60, 0.04), idle_face(0.0, 60.0, 3)
    motion = replace(
        idle.motion, poses=np.zeros_like(idle.motion.poses), steps=np.zeros_like(idle.motion.steps)
    )
    values = blend(masks, times, idle=replace(idle, motion=motion)).values
    left, right, up, down = (values[:, au(number)[0].column] for number in (61, 62, 63, 64))
    return 40.0 * (left - right), 30.0 * (up - down)


def test_idle_layer_shows_the_eyes_of_a_listener_and_of_a_thinker() -> None:
    listening, thinking, gaze = (
        still(mask_channel(name), 1.0, Layer.BASE) for name in ("listening", "thinking", "eyes")
    )
    usual, listens, thinks = gaze_of(), gaze_of(listening), gaze_of(thinking)
    assert np.hypot(*usual).max() < 3
    assert np.hypot(listens[0], listens[1] + 1).max() < 9
    assert np.mean(np.hypot(*listens) < 5) > 0.7  # on the other's face
    assert np.mean(np.hypot(*thinks) > 5) > 0.5  # averted
    assert np.mean(thinks[1] > 3) > np.mean(thinks[1] < -3)
    masked = gaze_of(thinking, replace(gaze, layer=Layer.GAZE))
    np.testing.assert_allclose(masked, usual, atol=1e-4)


def test_idle_layer_moves_brows_and_lower_lids_with_a_blink() -> None:
    idle, times = idle_face(0.0, 60.0, 3, liveliness=1.0), np.arange(0, 60, 0.02)
    blinking = idle_layer(idle, [], times)
    without = idle_layer(idle, [still(mask_channel("blinks"), 1.0, Layer.BASE)], times)
    shut = blinking.values[: len(lids())]
    for column, moves, rests in zip(blinking.face, blinking.small, without.small, strict=True):
        if column in face_columns(7):
            assert (moves >= 0.12 * shut[face_columns(7).index(column)]).all()
        if column in (*face_columns(7), *face_columns(4)):
            assert not np.array_equal(moves, rests)
            np.testing.assert_array_equal(moves[~shut.any(axis=0)], rests[~shut.any(axis=0)])
        else:
            np.testing.assert_array_equal(moves, rests)
