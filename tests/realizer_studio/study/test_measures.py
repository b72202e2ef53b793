"""Tests of `realizer_studio.study.measures`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realizer_studio.study.measures import (
    against_chance,
    angle_difference,
    circular_mean,
    hit_rates,
    interval,
    ratio,
)


def test_hit_rates_do_not_reward_who_always_gives_one_name() -> None:
    always = np.array([[10, 0, 0], [10, 0, 0]])
    assert hit_rates(always).tolist() == [0.5, 0.0]
    # Wagner 1993: the square of the hits, by the row and by the column.
    assert hit_rates(np.array([[8, 2, 0], [4, 4, 2]])) == pytest.approx([64 / 120, 16 / 60])
    assert math.isnan(hit_rates(np.array([[0, 0], [1, 1]]))[0])


def test_interval_is_that_of_students_t_far_from_limits() -> None:
    values = np.random.default_rng(1).normal(50, 1, 12)
    units = np.stack([values, np.ones(12)], axis=1)
    low, high = interval(units, ratio, (0, 100))
    half = 2.201 * values.std(ddof=1) / math.sqrt(12)
    assert high - low == pytest.approx(2 * half, rel=0.05)
    assert (low + high) / 2 == pytest.approx(values.mean(), abs=0.02)
    assert all(map(math.isnan, interval(units[:1], ratio, (0, 100))))
    assert all(map(math.isnan, interval(np.ones((5, 2)), ratio)))


def test_interval_stays_within_limits() -> None:
    units = np.array([[10, 10]] * 7 + [[9, 10]], float)
    low, high = interval(units, ratio)
    assert low < 79 / 80 < high < 1
    assert 79 / 80 - low > high - 79 / 80


def test_turn_is_the_short_way() -> None:
    assert [
        angle_difference(350, 10),
        angle_difference(10, 350),
        angle_difference(180, 0),
        angle_difference(90, 90),
    ] == [-20, 20, -180, 0]


def test_circular_mean_goes_over_zero() -> None:
    mean, length = circular_mean(np.array([-10.0, 20.0]))
    assert mean == pytest.approx(5)
    assert length == pytest.approx(math.cos(math.radians(15)))
    assert circular_mean(np.array([0.0, 180.0]))[1] == pytest.approx(0, abs=1e-9)


def test_against_chance_is_chi_square() -> None:
    statistic, p = against_chance(np.array([20.0, 5.0, 5.0]))
    assert statistic == pytest.approx(15)
    assert p == pytest.approx(math.exp(-7.5))  # two degrees of freedom
    assert all(map(math.isnan, against_chance(np.zeros(3))))
