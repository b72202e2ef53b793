"""Tests of noise in space."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.skin.noise import noise, ridges

AT = np.random.default_rng(1).uniform(-0.1, 0.1, (20_000, 3))


def test_noise_has_mean_0_and_deviation_1() -> None:
    values = noise(AT, 0.002, 3)
    assert values.mean() == pytest.approx(0, abs=0.05)
    assert values.std() == pytest.approx(1, abs=0.05)


def test_noise_is_the_same_for_a_seed_and_smooth() -> None:
    values = noise(AT, 0.002, 3)
    assert (values == noise(AT, 0.002, 3)).all()
    assert (values != noise(AT, 0.002, 4)).any()
    assert np.abs(values - noise(AT + 0.00002, 0.002, 3)).max() < 0.1


def test_ridges_are_thin_lines_of_1() -> None:
    values = ridges(AT, 0.002, 5)
    assert 0.95 < values.max() <= 1
    assert 0.1 < values.mean() < 0.4
