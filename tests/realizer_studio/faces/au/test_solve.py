"""Tests of the solver that fits displacement functions."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.au.functions import heading, height
from realizer_studio.faces.au.solve import Fit, least, lengths, mirrored_angles, mirrored_gaussians

RNG = np.random.default_rng(4)
AT = RNG.uniform((0, -2, -2), 2, (60, 3))
TWIN = np.array([-1, 1, 1])


@pytest.mark.parametrize(("layout", "count"), [("c", 1), ("p", 2), ("pcc", 4), ("pp", 4)])
def test_mirrored_gaussians_are_the_same_on_both_sides(layout: str, count: int) -> None:
    form = mirrored_gaussians(layout)
    gaussians = form(RNG.uniform(0.3, 1, form.matrix.shape[1])).reshape(-1, 10)
    assert len(gaussians) == count
    assert height(gaussians, AT) == pytest.approx(height(gaussians, AT * TWIN))


def test_mirrored_angles_point_to_mirrored_places() -> None:
    alpha, beta = mirrored_angles()
    free = RNG.uniform(-0.2, 0.2, 20)
    here, there = (heading(alpha(free[:7]), beta(free[7:]), at) for at in (AT, AT * TWIN))
    assert here * TWIN == pytest.approx(there)


def test_least_finds_the_bottom_of_a_valley() -> None:
    def valley(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        by = np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])
        return np.concatenate([[10 * (x[1] - x[0] ** 2), 1 - x[0]], np.zeros(9998)]), np.pad(
            by, ((0, 9998), (0, 0))
        )

    assert least(valley, np.array([-1.2, 1.0]), 100) == pytest.approx([1, 1], abs=0.01)


def test_lengths_weigh_a_short_miss_more_than_a_long_one() -> None:
    miss = np.array([[0.3, 0, 0.4], [0, 0, 0]])
    near, at_goal = lengths(miss, np.ones(2)) ** 2
    assert near == pytest.approx(2, rel=1e-3)
    assert at_goal == pytest.approx(250)


def test_fit_starts_in_the_direction_of_the_moves() -> None:
    way = np.array([0, 0.6, 0.8])
    fit = Fit(AT, np.repeat(way[None], len(AT), 0), np.ones(len(AT)), AT[:0])
    (best, cost), *others = fit.directions()
    assert cost < 0.01
    assert all(cost <= other for _, other in others)
    assert heading(fit.alpha(best[:7]), fit.beta(best[7:]), AT) == pytest.approx(
        np.repeat(way[None], len(AT), 0), abs=0.01
    )
