"""Idle motion is a function of seed and time."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.blend import blend
from realizer.animation.fap import to_fap
from realizer.animation.idle import Blinks, idle_face
from realizer.animation.targets import AU_NAMES, au
from realizer.arrays import Float32, Float64

LEFT_LID = au(45, "LEFT")[0].column


def idle(times: Float64, seed: int = 0) -> Float32:
    return blend([], times, idle=idle_face(float(times[0]), float(times[-1]), seed)).values


def blinks(seed: int, until: float) -> Float64:
    return idle_face(0.0, until, seed).blinks.onsets


@given(st.integers(0, 2**40), st.floats(0, 20_000), st.floats(0.1, 8), st.floats(0.1, 8))
def test_any_two_windows_agree_where_they_overlap(seed: int, begin: float, one: float, two: float) -> None:
    times = begin + np.arange(0, one + two, 0.05)
    split = max(1, int(len(times) * one / (one + two)))
    whole = idle(times, seed)
    np.testing.assert_array_equal(whole[:split], idle(times[:split], seed))
    np.testing.assert_array_equal(
        whole[split:], idle(times[split:], seed) if split < len(times) else whole[split:]
    )


def test_two_faces_do_not_move_alike() -> None:
    times = np.arange(0, 10, 0.04)
    assert not np.array_equal(idle(times, 0), idle(times, 1))


@given(st.integers(0, 2**40))
def test_blinks_come_every_two_and_a_half_to_six_seconds(seed: int) -> None:
    gaps = np.diff(blinks(seed, 600.0))
    assert gaps.min() >= 2.5 - 1e-9
    assert gaps.max() <= 6.0 + 1e-9
    assert 3.3 < gaps.mean() < 4.6
    assert gaps.std() > 0.4


def test_a_blink_closes_faster_than_it_opens_and_takes_three_tenths_of_a_second() -> None:
    onset = blinks(3, 10.0)[0]
    lids = idle(onset + np.array([-0.001, 0.08, 0.13, 0.15, 0.301]), 3)[:, LEFT_LID]
    assert lids[[0, 1, 2, 4]].tolist() == [0, 1, 1, 0]
    assert 0.8 < lids[3] < 1


def test_every_blink_shuts_the_eyes_on_a_frame_at_25_fps() -> None:
    times = np.arange(0, 60, 0.04)
    lids = idle(times, 5)[:, LEFT_LID]
    for onset in blinks(5, 59.0):
        assert lids[(times >= onset) & (times <= onset + 0.3)].max() == 1


def test_motion_stays_small_and_smooth() -> None:
    times = np.arange(0, 60, 0.01)
    faps = to_fap(blend([], times, idle=idle_face(0, 60, 1))).values
    degrees = np.degrees(faps[:, 47:50] * 1e-5)
    assert 0.3 < np.abs(degrees).max() < 2.0
    assert np.abs(np.diff(degrees, axis=0)).max() < 0.1  # 10 degrees a second
    eyes = np.degrees(faps[:, 22:26] * 1e-5)
    assert 0.3 < np.abs(eyes).max() < 3.5


def test_eyes_stay_on_their_point_while_the_head_sways() -> None:
    times = np.arange(0, 60, 0.01)
    faps = to_fap(blend([], times, idle=idle_face(0, 60, 1))).values
    gaze = np.degrees((faps[:, 22] + faps[:, 48]) * 1e-5)
    still = np.abs(np.diff(gaze)) < 1e-3
    assert still.mean() > 0.9


def draws(begin: float, end: float, seed: int) -> dict[float, float]:
    """Onset -> draw of every blink."""
    seen = idle_face(begin, end, seed).blinks
    return dict(zip(seen.onsets.tolist(), seen.draws.tolist(), strict=True))


@given(st.integers(0, 2**40))
def test_each_blink_has_a_draw_of_its_own_in_any_window_evenly_spread(seed: int) -> None:
    whole = draws(0, 600, seed)
    assert draws(290, 310, seed).items() <= whole.items()
    assert min(whole.values()) >= 0
    assert max(whole.values()) < 1
    assert 0.35 < np.mean(list(whole.values())) < 0.65


def test_both_lids_blink_and_each_column_moves_once() -> None:
    frames = blend([], np.arange(0, 20, 0.04), idle=idle_face(0, 20, 7))
    left, right = (frames.values[:, lid.column] for lid in au(45))
    assert left.max() == 1
    np.testing.assert_array_equal(left, right)
    moves = idle_face(0, 20, 7).motion.columns
    assert sorted(AU_NAMES()[column] for column in moves) == [
        str(n) for n in (*range(51, 57), *range(61, 65))
    ]


def test_blinks_that_speech_brings_together_shut_the_lids_as_the_one_that_is_further() -> None:
    times = np.arange(0, 1, 0.01)
    one, other = (Blinks(np.array([onset]), np.zeros(1)).at(times) for onset in (0.2, 0.3))
    both = Blinks(np.array([0.3, 0.2]), np.zeros(2)).at(times)
    np.testing.assert_array_equal(both, np.maximum(one, other))
