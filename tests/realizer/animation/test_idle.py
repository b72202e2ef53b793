"""Idle motion is a function of seed and time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.blend import blend
from realizer.animation.channel import Layer
from realizer.animation.fap import to_fap
from realizer.animation.idle import Blink, idle_channels
from realizer.animation.targets import au
from realizer.arrays import Float32, Float64

LEFT_LID = au(45, "LEFT")[0].column


def idle(times: Float64, seed: int = 0) -> Float32:
    return blend(idle_channels(float(times[0]), float(times[-1]), seed), times).values


def blinks(seed: int, until: float) -> Float64:
    channels = [c for c in idle_channels(0.0, until, seed) if c.target.column == LEFT_LID]
    return np.sort([c.times[0] for c in channels])


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
    channel = next(c for c in idle_channels(0, 10, 3) if c.target.column == LEFT_LID)
    close, shut, open_ = np.diff(channel.times)
    assert close < open_
    assert close + shut + open_ == pytest.approx(0.3)
    assert channel.values.tolist() == [0, 1, 1, 0]


def test_every_blink_shuts_the_eyes_on_a_frame_at_25_fps() -> None:
    times = np.arange(0, 60, 0.04)
    lids = idle(times, 5)[:, LEFT_LID]
    for onset in blinks(5, 59.0):
        assert lids[(times >= onset) & (times <= onset + 0.3)].max() == 1


def test_motion_stays_small_and_smooth() -> None:
    times = np.arange(0, 60, 0.01)
    faps = to_fap(blend(idle_channels(0, 60, 1), times)).values
    degrees = np.degrees(faps[:, 47:50] * 1e-5)
    assert 0.3 < np.abs(degrees).max() < 2.0
    assert np.abs(np.diff(degrees, axis=0)).max() < 0.1  # 10 degrees a second
    eyes = np.degrees(faps[:, 22:26] * 1e-5)
    assert 0.3 < np.abs(eyes).max() < 3.5


def test_eyes_stay_on_their_point_while_the_head_sways() -> None:
    times = np.arange(0, 60, 0.01)
    channels = [c for c in idle_channels(0, 60, 1) if c.target.column != LEFT_LID]
    faps = to_fap(blend(channels, times)).values
    gaze = np.degrees((faps[:, 22] + faps[:, 48]) * 1e-5)
    still = np.abs(np.diff(gaze)) < 1e-3
    assert still.mean() > 0.9


def draws(begin: float, end: float, seed: int) -> dict[float, float]:
    """Onset -> draw of every blink."""
    return {float(c.times[0]): c.draw for c in idle_channels(begin, end, seed) if isinstance(c, Blink)}


@given(st.integers(0, 2**40))
def test_each_blink_has_a_draw_of_its_own_in_any_window_evenly_spread(seed: int) -> None:
    whole = draws(0, 600, seed)
    assert draws(290, 310, seed).items() <= whole.items()
    assert min(whole.values()) >= 0
    assert max(whole.values()) < 1
    assert 0.35 < np.mean(list(whole.values())) < 0.65


def test_it_stands_in_its_layer() -> None:
    assert {c.layer for c in idle_channels(0, 10, 0)} == {Layer.IDLE}
