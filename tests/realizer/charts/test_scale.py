"""Tests of the time axis."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.charts.scale import APART, WIDEST, Scale, scale_of


@given(st.floats(0, 1e4), st.floats(0.1, 4000))
def test_scale_ticks_are_round_apart_and_inside(first: float, length: float) -> None:
    scale = Scale(first, first + length, 1200.0)
    times = [time for time, _ in scale.ticks()]
    assert times == sorted(times)
    assert all(first - 1e-6 <= t <= first + length + 1e-6 for t in times)
    assert all((b - a) * scale.second >= APART * 0.999 for a, b in itertools.pairwise(times))
    assert all(float(words) == pytest.approx(t, abs=1e-6) for t, words in scale.ticks())


def test_scale_limits_times_to_the_picture() -> None:
    scale = Scale(0.0, 2.0, 1200.0)
    assert scale.x(-5) == scale.x(0.0) == scale.left
    assert scale.x(5) == scale.x(2.0) == scale.right
    assert scale.x(1.0) == (scale.left + scale.right) / 2


def test_scale_of_a_longer_block_is_wider_up_to_a_limit(lines) -> None:
    widths = [
        scale_of(lines(f'<bml id="b"><wait id="w" duration="{seconds}"/></bml>')).width
        for seconds in (1, 10, 30, 500)
    ]
    assert widths[0] == widths[1] < widths[2] < widths[3] == WIDEST


def test_scale_of_nothing_is_valid() -> None:
    assert list(scale_of([]).ticks())
