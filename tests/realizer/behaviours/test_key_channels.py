"""Tests of channels through keys."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import au, fap
from realizer.animation.channel import Layer
from realizer.behaviours.key_channels import EASE, track

values = st.lists(st.floats(-1, 1), min_size=2, max_size=6)


def test_track_at_rest_at_both_ends_keeps_its_keys() -> None:
    channel = track(au(12, "LEFT")[0], np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.04]), "k")
    assert channel.times.tolist() == [1, 2, 3]
    assert channel.values.tolist() == [0, 1, 0.04]
    assert (channel.curve, channel.source) == ("linear", "k")


def test_track_not_at_rest_is_eased_at_both_ends() -> None:
    channel = track(au(12, "LEFT")[0], np.array([1.0, 3.0]), np.array([1.0, 0.5]), "k")
    assert channel.times == pytest.approx([1, 1 + EASE, 3 - EASE, 3])
    assert channel.values == pytest.approx([0, 1 - 0.25 * EASE, 0.5 + 0.25 * EASE, 0])


def test_track_of_a_fap_overrides_what_lies_below_with_eased_weight() -> None:
    channel = track(fap(31), np.array([0.0, 1.0, 2.0]), np.array([0.0, 100.0, 0.0]), "k")
    assert channel.layer is Layer.FAPS
    assert np.interp([0, EASE, 1, 2 - EASE, 2], channel.times, channel.weight) == pytest.approx(
        [0, 1, 1, 1, 0]
    )
    assert np.interp([0.5, 1, 1.5], channel.times, channel.values) == pytest.approx([50, 100, 50])


@given(values, st.sampled_from([0.1, 1.0, 10.0]))
def test_track_starts_and_ends_at_rest(heights: list[float], length: float) -> None:
    channel = track(au(4)[0], np.linspace(0, length, len(heights)), np.array(heights), "k")
    rest = 0.05 * max(map(abs, heights))
    assert abs(channel.values[0]) <= rest
    assert abs(channel.values[-1]) <= rest
    assert (np.diff(channel.times) >= 0).all()
    assert (channel.times[0], channel.times[-1]) == (0, length)
