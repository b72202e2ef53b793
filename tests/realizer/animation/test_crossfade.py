"""Crossfades to channels with other times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import au
from realizer.animation.channel import Channel, Gain
from realizer.animation.crossfade import DURATION, crossfade
from realizer.animation.curves import sample

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
