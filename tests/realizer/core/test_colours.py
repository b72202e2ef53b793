"""Tests of `realizer.core.colours`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.colours import linear, srgb


def test_linear_and_srgb_are_inverse_for_every_byte():
    bytes_ = np.arange(256).astype(np.uint8)
    assert np.array_equal(np.rint(srgb(linear(bytes_)) * 255), bytes_)


def test_linear_is_straight_near_black_and_a_power_above():
    assert linear(np.uint8(5)) == pytest.approx(5 / 255 / 12.92)
    assert linear(np.uint8(188)) == pytest.approx(0.5029, abs=1e-4)


def test_srgb_clips_light():
    assert srgb(np.float32([-1, 0, 1, 7])) == pytest.approx(np.array([0, 0, 1, 1]))
