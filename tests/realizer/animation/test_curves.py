"""Sampling of channels."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from realizer.animation.axis import au
from realizer.animation.channel import Channel, Crossfade, Gain
from realizer.animation.curves import CURVES, DURATION, MANY_KEYS, crossfade, sample, smooth, weights

TARGET = au(12, "LEFT")[0]


@st.composite
def channels(draw: st.DrawFn) -> Channel:
    keys = draw(st.integers(1, 6) | st.just(MANY_KEYS + 5))
    gaps = draw(st.lists(st.floats(0.01, 2.0), min_size=keys, max_size=keys))
    values = draw(st.lists(st.floats(0.0, 1.0), min_size=keys, max_size=keys))
    begin = draw(st.floats(-5.0, 100.0))
    return Channel(
        TARGET,
        begin + np.cumsum(gaps),
        np.array(values),
        curve=draw(st.sampled_from(sorted(CURVES))),
        keeps_last=draw(st.booleans()),
    )


@given(st.lists(channels(), min_size=1, max_size=5))
def test_sample_hits_the_keys(given: list[Channel]) -> None:
    for row, channel in enumerate(given):
        np.testing.assert_array_equal(sample(given, channel.times)[row], channel.values)


@given(channels(), st.floats(0.001, 50.0))
def test_sample_is_zero_outside_the_keys(channel: Channel, away: float) -> None:
    before, after = sample([channel], np.array([channel.times[0] - away, channel.times[-1] + away]))[0]
    assert before == 0
    assert after == (channel.values[-1] if channel.keeps_last else 0)


@given(channels(), st.lists(st.floats(-10, 120), min_size=1, max_size=30))
def test_sample_is_independent_of_the_other_times(channel: Channel, times: list[float]) -> None:
    whole = sample([channel], np.array(times))[0]
    alone = [sample([channel], np.array([t]))[0, 0] for t in times]
    np.testing.assert_array_equal(whole, alone)


@given(channels())
def test_sample_stays_between_neighbouring_keys(channel: Channel) -> None:
    assume(len(channel.times) > 1)
    at = (channel.times[:-1] + channel.times[1:]) / 2
    values = sample([channel], at)[0]
    assert np.all(values >= np.minimum(channel.values[:-1], channel.values[1:]) - 1e-12)
    assert np.all(values <= np.maximum(channel.values[:-1], channel.values[1:]) + 1e-12)


def test_smooth_has_no_velocity_at_both_ends() -> None:
    u = np.array([0.0, 1e-4, 0.5, 1 - 1e-4, 1.0])
    assert smooth(u)[[0, 2, 4]] == pytest.approx([0.0, 0.5, 1.0])
    assert smooth(u)[1] < 1e-10
    assert 1 - smooth(u)[3] < 1e-10


@given(st.floats(0.05, 2.0), st.floats(0.0, 3.0))
def test_sample_of_a_faded_channel_reaches_zero_smoothly(length: float, begin: float) -> None:
    channel = Channel(TARGET, np.array([0.0, 1.0]), np.array([0.0, 1.0]), keeps_last=True)
    faded = channel.faded(begin, begin + length)
    times = np.linspace(0, begin + length + 0.5, 2000)
    values, before = sample([faded, channel], times)
    np.testing.assert_array_equal(values[times <= begin], before[times <= begin])
    assert np.all(values[times >= begin + length] == 0)
    # 1.875 is the steepest of the minimum-jerk curve; rise and fade may meet.
    assert np.max(np.abs(np.diff(values))) <= 1.9 * (times[1] - times[0]) * (1 + 1 / length)


def test_sample_of_a_faded_and_a_rising_channel_adds_up() -> None:
    old = Channel(TARGET, np.array([0.0]), np.array([0.7]), keeps_last=True).faded(1.0, 2.0)
    new = Channel(TARGET, np.array([1.0, 2.0]), np.array([0.0, 0.7]), keeps_last=True)
    assert sample([old, new], np.linspace(0, 3, 61)).sum(axis=0) == pytest.approx(0.7)


def test_sample_uses_the_later_of_two_keys_at_one_time() -> None:
    channel = Channel(TARGET, np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 0.2, 0.8, 0.0]), curve="linear")
    assert sample([channel], np.array([0.999999, 1.0, 1.5]))[0] == pytest.approx([0.2, 0.8, 0.4], abs=1e-5)


def test_sample_of_nothing_is_empty() -> None:
    assert sample([], np.array([0.0, 1.0])).shape == (0, 2)
    assert sample([Channel(TARGET, np.array([0.0]), np.array([1.0]))], np.array([])).shape == (1, 0)


def test_sample_refuses_an_unknown_curve() -> None:
    with pytest.raises(KeyError, match="wobbly"):
        sample([Channel(TARGET, np.array([0.0]), np.array([1.0]), curve="wobbly")], np.array([0.0]))


def test_weights_include_gains() -> None:
    ends = Channel(TARGET, np.array([1.0, 2.0]), np.array([0.3, 0.3]))
    stays = Channel(TARGET, np.array([1.0]), np.array([0.0]), keeps_last=True).faded(3.0, 4.0)
    times = np.array([0.9, 1.0, 2.0, 2.1, 3.5, 4.0])
    assert weights([ends, stays], times).tolist() == [[0, 1, 1, 0, 0, 0], [0, 1, 1, 1, 0.5, 0]]


@given(at=st.floats(0.2, 1.8), later=st.floats(-0.15, 1.0), length=st.floats(0.1, 0.6))
def test_sample_of_a_crossfade_is_continuous_in_value_and_slope(
    at: float, later: float, length: float
) -> None:
    old = Channel(TARGET, np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.8, 0.0]))
    new = Channel(TARGET, np.array([0.0, 1.0 + later, 2.2 + later]), np.array([0.0, 0.8, 0.0]))
    h = 1e-5
    around = sample([old, new], np.array([at - h, at, at + h]))
    value = around[0, 1] - around[1, 1]
    slope = ((around[0, 2] - around[0, 0]) - (around[1, 2] - around[1, 0])) / (2 * h)
    pair = [replace(old, until=at), replace(new, crossfade=Crossfade(at, value, slope, length))]
    times = np.array([at - 2 * h, at - h, at, at + h, at + 2 * h])
    shown = sample(pair, times).sum(axis=0)
    assert np.abs(np.diff(shown)).max() < 5 * h, "no jump"
    assert np.abs(np.diff(shown, 2)).max() < 100 * h * h, "and no kink"
    healed = np.array([at + length, at + length + 0.1])
    assert sample(pair, healed).sum(axis=0) == pytest.approx(sample([new], healed)[0])
    before = np.linspace(0, at, 7)[:-1]
    assert sample(pair, before).sum(axis=0) == pytest.approx(sample([old], before)[0])


def test_sample_tolerates_key_times_that_fall_by_a_rounding() -> None:
    keys, values = np.array([0.0, 1.0, 1.0 - 1e-9, 2.0]), np.array([0.0, 0.2, 0.8, 0.0])
    falling = Channel(TARGET, keys, values, curve="linear")
    assert sample([falling], np.array([0.5, 1.0 - 5e-10, 1.0, 1.5]))[0] == pytest.approx([0.1, 0.2, 0.8, 0.4])


def test_sample_of_many_channels_is_that_of_each_alone() -> None:
    times = np.linspace(0.0, 3.0, 40)
    keys = np.linspace(0.5, 2.0, MANY_KEYS)
    many = [
        Channel(TARGET, np.array([0.1, 0.9, 1.4]), np.array([0.0, 1.0, 0.0])),
        Channel(TARGET, keys, keys / 2, curve="linear", keeps_last=True),
        Channel(TARGET, np.array([0.3]), np.array([0.6]), keeps_last=True).faded(1.0, 2.0),
        Channel(TARGET, np.array([0.0, 2.0]), np.array([0.0, 0.7]), crossfade=Crossfade(0.7, 0.2, 0.1, 0.4)),
        Channel(TARGET, np.array([0.0, 2.0]), np.array([0.3, 0.7]), curve="linear", until=1.2),
        Channel(TARGET, np.array([5.0, 6.0]), np.array([0.3, 0.7])),
        Channel(TARGET, keys, 1 - keys / 4, curve="linear"),
        Channel(TARGET, keys, keys**2 / 4, curve="linear"),
        Channel(TARGET, keys + 9.0, keys / 2, curve="linear"),
    ]
    for channel, row in zip(many, sample(many, times), strict=True):
        np.testing.assert_array_equal(row, sample([channel], times)[0])
    nothing = [5, -1]
    assert not sample(many, times)[nothing].any()


@given(st.lists(st.floats(-1.0, 4.0), min_size=1, max_size=20))
def test_sample_interpolates_channels_with_many_keys(times: list[float]) -> None:
    keys = np.linspace(0.5, 2.0, MANY_KEYS) ** 2
    values = np.sin(9 * keys)
    both = [Channel(TARGET, keys, values, curve="linear", keeps_last=holds) for holds in (False, True)]
    ends, stays = sample(both, np.array(times))
    np.testing.assert_allclose(stays, np.interp(times, keys, values, left=0.0), atol=1e-12)
    np.testing.assert_allclose(ends, np.interp(times, keys, values, left=0.0, right=0.0), atol=1e-12)


SMILE, BROW = au(12, "LEFT")[0], au(4, "LEFT")[0]


def hill(*times: float, target=SMILE) -> Channel:
    return Channel(target, np.array(times), np.array([0.0, 0.8, 0.8, 0.0]))


def shown(channels: tuple[Channel, ...], times: np.ndarray) -> np.ndarray:
    return sample(channels, times).sum(axis=0)


@given(st.floats(0.05, 2.9), st.floats(-0.5, 2.0), st.floats(-0.5, 2.0))
def test_crossfade_keeps_value_and_velocity(now: float, first: float, second: float) -> None:
    old = hill(0.0, 0.5, 2.0, 3.0)
    new = hill(0.0, 0.5, 2.0 + max(first, -1.4), 3.0 + max(first, -1.4) + max(second, -0.9))
    both = crossfade([old], [new], now)
    times = now + np.arange(-50, 50) * 1e-4
    course = shown(both, times)
    velocity = np.diff(course) / 1e-4
    # The steepest of old, new and healing is about 8 a second; a kink would show as a step of velocity.
    assert np.abs(np.diff(course)).max() < 2e-3
    assert np.abs(np.diff(velocity)).max() < 0.25


def test_crossfade_goes_from_the_old_to_the_new_channel() -> None:
    old, new = hill(0.0, 0.5, 2.0, 3.0), hill(0.0, 0.5, 3.0, 4.0)
    both = crossfade([old], [new], 2.5)
    early, late = np.linspace(0, 2.4, 20), np.linspace(2.5 + DURATION, 4, 20)
    assert shown(both, early) == pytest.approx(shown((old,), early))
    assert shown(both, late) == pytest.approx(shown((new,), late))


def test_crossfade_keeps_earlier_replacements() -> None:
    first = crossfade([hill(0.0, 0.5, 2.0, 3.0)], [hill(0.0, 0.5, 3.0, 4.0)], 1.0)
    second = crossfade(first, [hill(0.0, 0.5, 3.5, 4.5)], 2.0)
    early = np.linspace(0, 1.99, 40)
    assert shown(second, early) == pytest.approx(shown(first, early))
    assert shown(second, np.array([4.0])) > 0.1


def test_crossfade_inherits_gains() -> None:
    old = replace(hill(0.0, 0.5, 2.0, 3.0), gains=(Gain(0.6, 1.0, 0.5),))
    both = crossfade([old], [hill(0.0, 0.5, 3.0, 4.0)], 1.5)
    assert shown(both, np.array([2.5])) == pytest.approx([0.4])


def test_crossfade_pairs_targets_and_fades_the_others() -> None:
    old = [hill(0.0, 0.5, 2.0, 3.0), hill(0.0, 0.5, 2.0, 3.0, target=BROW)]
    both = crossfade(old, [hill(0.0, 0.5, 2.5, 3.5)], 1.0)
    rows = {c.target.name: 0.0 for c in both}
    for channel, value in zip(both, sample(both, np.array([1.0 + DURATION]))[:, 0], strict=True):
        rows[channel.target.name] += value
    assert rows == {"12L": pytest.approx(0.8), "4L": pytest.approx(0.0)}


def test_crossfade_keeps_channels_that_did_not_change() -> None:
    stays, goes = hill(0.0, 0.5, 2.0, 3.0), hill(0.0, 0.5, 2.0, 3.0)
    later = replace(goes, times=goes.times * 1.5)
    both = crossfade([stays, goes], [replace(stays), later], 1.0)
    assert stays in both
    assert [c.until for c in both if c.crossfade is None] == [float("inf"), 1.0]
    assert shown(both[1:], np.array([4.0])) == pytest.approx(shown((later,), np.array([4.0])))
