"""Blinks as a function of seed, time and speech."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.idle.blinks import Blinks, PhraseEnd, blinks_between
from realizer.core.array_types import Float64


def blinks(seed: int, until: float) -> Float64:
    return blinks_between(0.0, until, seed).onsets


@given(st.integers(0, 2**40))
def test_blinks_are_two_and_a_half_to_six_seconds_apart(seed: int) -> None:
    gaps = np.diff(blinks(seed, 600.0))
    assert gaps.min() >= 2.5 - 1e-9
    assert gaps.max() <= 6.0 + 1e-9
    assert 3.3 < gaps.mean() < 4.6
    assert gaps.std() > 0.4


def test_blinks_close_faster_than_they_open_and_last_0_3_s() -> None:
    onset = blinks(3, 10.0)[0]
    lids = blinks_between(0.0, 10.0, 3).at(onset + np.array([-0.001, 0.08, 0.13, 0.15, 0.301]))
    assert lids[[0, 1, 2, 4]] == pytest.approx([0, 1, 1, 0])
    assert 0.8 < lids[3] < 1


def test_blinks_shut_the_eyes_in_a_frame_at_25_fps() -> None:
    times = np.arange(0, 60, 0.04)
    lids = blinks_between(0.0, 60.0, 5).at(times)
    for onset in blinks(5, 59.0):
        assert lids[(times >= onset) & (times <= onset + 0.3)].max() == 1


def draws(begin: float, end: float, seed: int) -> dict[float, float]:
    """Onset -> draw of every blink."""
    seen = blinks_between(begin, end, seed)
    return dict(zip(seen.onsets.tolist(), seen.draws.tolist(), strict=True))


@given(st.integers(0, 2**40))
def test_blinks_have_uniform_draws_independent_of_the_window(seed: int) -> None:
    whole = draws(0, 600, seed)
    assert draws(290, 310, seed).items() <= whole.items()
    assert min(whole.values()) >= 0
    assert max(whole.values()) < 1
    assert 0.35 < np.mean(list(whole.values())) < 0.65


@given(st.integers(0, 2**40), st.floats(0, 600), st.floats(0, 60))
def test_blinks_between_two_times_are_those_that_show_then(seed: int, start: float, length: float) -> None:
    onsets = blinks(seed, start + length)
    shown = onsets[onsets + 0.3 > start]
    np.testing.assert_array_equal(blinks_between(start, start + length, seed).onsets, shown)
    assert blinks(seed, start).max(initial=0.0) <= start


def test_blinks_that_overlap_show_the_stronger_one() -> None:
    times = np.arange(0, 1, 0.01)
    one, other = (Blinks(np.array([onset]), np.zeros(1)).at(times) for onset in (0.2, 0.3))
    both = Blinks(np.array([0.3, 0.2]), np.zeros(2)).at(times)
    np.testing.assert_array_equal(both, np.maximum(one, other))


@given(st.integers(0, 2**40), st.floats(-0.2, 0.2))
def test_blinks_near_the_end_of_a_phrase_wait_for_it(seed: int, later: float) -> None:
    plain = blinks(seed, 60.0)
    end = PhraseEnd(0.0, plain[3] + later)
    moved = blinks_between(0.0, 60.0, seed, (end,)).onsets
    assert plain[3] not in moved
    assert end.at <= moved[3] <= end.at + 0.6
    assert blinks_between(0.0, 60.0, seed, (PhraseEnd(plain[3] + 9, plain[3] + 9.1),)).onsets[3] == plain[3]
