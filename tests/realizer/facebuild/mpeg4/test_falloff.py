"""Tests of the curves from a zone's middle to its edge."""

import numpy as np
import pytest

from realizer.facebuild.mpeg4.falloff import cosine, ease, linear, smooth_curve

D = np.linspace(0, 1, 101)


@pytest.mark.parametrize("curve", [linear, cosine, lambda d: ease(d, 40), lambda d: smooth_curve(d, 0.5, 0)])
def test_falloff_runs_from_1_in_the_middle_to_0_at_the_edge(curve) -> None:  # type: ignore[no-untyped-def]
    values = curve(D)
    assert values[0] == pytest.approx(1)
    assert values[-1] == pytest.approx(0, abs=1e-9)
    assert (np.diff(values) <= 1e-12).all()
    assert curve(np.array([7.0])) == pytest.approx(0)


@pytest.mark.parametrize(("amount", "power"), [(0, 1), (-50, 0.5), (-80, 0.2), (20, 2), (50, 3.5), (80, 5)])
def test_ease_is_one_less_the_distance_to_a_power(amount: float, power: float) -> None:
    assert np.allclose(ease(D, amount), 1 - D**power)


def test_ease_above_0_means_more_influence() -> None:
    assert (ease(D, 60)[1:-1] > linear(D)[1:-1]).all()
    assert (ease(D, -60)[1:-1] < linear(D)[1:-1]).all()


def test_smooth_curve_without_smoothing_is_a_straight_line() -> None:
    assert np.allclose(smooth_curve(D, 0, 0), linear(D), atol=1e-6)


def test_smooth_curve_levels_the_middle_and_widens_the_edge() -> None:
    level = smooth_curve(np.array([0, 0.01]), 0.5, 0)
    assert 1 - level[1] < 0.001
    past = smooth_curve(np.array([1.0, 1.49, 1.51]), 0, 0.5)
    assert past[0] > 0.05
    assert 0 < past[1] < 0.001
    assert past[2] == 0
