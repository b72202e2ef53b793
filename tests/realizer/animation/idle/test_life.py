"""Breathing, posture, small movements and swallows."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES
from realizer.animation.idle.life import life_between
from realizer.animation.idle.motion import motion_columns
from realizer.core.array_types import Float64

TIMES = np.arange(0, 600, 0.04)


def units(seed: int, times: Float64 = TIMES) -> dict[str, Float64]:
    """Return the values of each AU."""
    life = life_between(float(times[0]), float(times[-1]), seed, 1.0)
    names = [AU_NAMES()[column] for column in (*motion_columns(), *life.face)]
    return dict(zip(names, np.concatenate(life.at(times)), strict=True))


def rises(values: Float64, level: float) -> int:
    """Return how often values rise above a level."""
    return int(np.sum((values[1:] > level) & (values[:-1] <= level)))


@given(st.integers(0, 2**40), st.floats(0, 20_000))
def test_life_is_smooth_and_the_same_in_any_window(seed: int, begin: float) -> None:
    times = begin + np.arange(0, 70, 0.04)
    whole, part = units(seed, times), units(seed, times[800:1100])
    for name, values in whole.items():
        np.testing.assert_array_equal(values[800:1100], part[name])
        assert np.abs(np.diff(values)).max() < 0.1
        assert values.min() >= 0


def test_life_breathes_as_people_at_rest() -> None:
    minutes = [rises(units(seed)["38L"], 0.05) / 10 for seed in range(8)]
    assert 12 <= min(minutes) <= max(minutes) <= 20  # a minute (Tobin et al. 1983)
    assert max(minutes) - min(minutes) > 1


def test_life_swallows_about_once_a_minute() -> None:
    assert 4 <= rises(units(3)["24"], 0.1) <= 12


def test_life_moves_single_muscles_every_few_seconds() -> None:
    found = units(3)
    events = {name: rises(found[name], 0.015) for name in ("1L", "2L", "4L", "7L", "12L", "14L", "17")}
    assert all(count >= 15 for count in events.values())
    assert 1.5 < 600 / sum(events.values()) < 5.0
    for name in ("1", "2", "4", "7", "12", "14"):
        left, right = found[f"{name}L"], found[f"{name}R"]
        assert 0.05 < max(left.max(), right.max()) <= 0.1
        assert 0.01 < np.abs(left - right).max() < 0.07


def test_life_drifts_like_pink_noise() -> None:
    found = [units(seed) for seed in range(8)]
    turns = np.array([unit["51"] - unit["52"] for unit in found])
    power = np.square(np.abs(np.fft.rfft(turns * np.hanning(len(TIMES))))).mean(axis=0)
    hertz = np.fft.rfftfreq(len(TIMES), 0.04)
    part = (hertz > 0.01) & (hertz < 0.25)
    slope = np.polyfit(np.log(hertz[part]), np.log(power[part]), 1)[0]
    assert -2.5 < slope < -0.7


def test_life_keeps_the_eyes_on_their_point() -> None:
    found = units(3)
    for head, eyes in ((("51", "52"), ("61", "62")), (("53", "54"), ("63", "64"))):
        degrees = 60.0 if head[0] == "51" else 40.0
        most = 40.0 if head[0] == "51" else 25.0
        turned = degrees * (found[head[0]] - found[head[1]]) + most * (found[eyes[0]] - found[eyes[1]])
        np.testing.assert_allclose(turned, 0.0, atol=1e-9)
