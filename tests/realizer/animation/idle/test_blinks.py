"""Blinks as a function of seed, time and speech."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import parse
from realizer.animation.axis import au
from realizer.animation.idle.blinks import (
    Blinks,
    GazeShift,
    Occasions,
    PhraseEnd,
    blinks_between,
    gaze_shifts,
)
from realizer.behaviours.registry import VOCABULARY
from realizer.core.array_types import Float64
from realizer.core.options import PlayOptions
from realizer.playback.player import Player


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
    lids, right = blinks_between(0.0, 10.0, 3).at(onset + np.array([-0.001, 0.08, 0.13, 0.15, 0.301]))
    np.testing.assert_array_equal(lids, right)
    assert lids[[0, 1, 2, 4]] == pytest.approx([0, 1, 1, 0])
    assert 0.8 < lids[3] < 1


def test_blinks_shut_the_eyes_in_a_frame_at_25_fps() -> None:
    times = np.arange(0, 60, 0.04)
    lids = blinks_between(0.0, 60.0, 5).at(times)[0]
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
    times, both = np.arange(0, 60, 0.01), blinks_between(0.0, 60.0, 5, liveliness=1.0)
    near = replace(both, onsets=both.onsets[0] + 0.1 * np.arange(len(both.onsets)))
    every = [near.only(np.arange(len(near.onsets)) == k).at(times) for k in range(len(near.onsets))]
    np.testing.assert_array_equal(near.at(times), np.max(every, axis=0))


def occasions(
    *ends: PhraseEnd, saccades: Sequence[float] = (), shifts: Sequence[GazeShift] = ()
) -> Occasions:
    return Occasions(ends, np.array(saccades), shifts)


@given(st.integers(0, 2**40), st.floats(-0.2, 0.2))
def test_blinks_near_the_end_of_a_phrase_wait_for_it(seed: int, later: float) -> None:
    plain = blinks(seed, 60.0)
    end = PhraseEnd(0.0, plain[3] + later)
    moved = blinks_between(0.0, 60.0, seed, occasions(end)).onsets
    assert plain[3] not in moved
    assert end.at <= moved[3] <= end.at + 0.6
    unknown = occasions(PhraseEnd(plain[3] + 9, plain[3] + 9.1))
    assert blinks_between(0.0, 60.0, seed, unknown).onsets[3] == plain[3]


def alive(seed: int, until: float = 3600.0, *ends: PhraseEnd, **more: Any) -> Blinks:
    return blinks_between(0.0, until, seed, occasions(*ends, **more), 1.0)


def test_blinks_of_a_living_face_vary_as_those_of_people() -> None:
    found = alive(3)
    gaps, lengths = np.diff(found.onsets), found.keys[-1]
    assert 14 < len(gaps) / 60 < 21  # a minute at rest: 17 (Bentivoglio et al. 1997)
    assert (gaps >= 0.449).all()
    assert (gaps <= 15.001).all()
    assert 0.6 < np.log(gaps).std() < 0.85
    # 334 ms, sd 67, as far as seen (VanderWerff et al. 2003); the first and last frames hardly move.
    assert 0.35 < lengths.mean() < 0.4
    assert 0.05 < lengths.std() < 0.09
    assert 0.1 < np.mean(found.amounts < 1.0) < 0.2  # Doane 1980
    assert (found.amounts >= 0.45).all()
    lags = np.abs(found.lags)
    assert (lags >= 0.00499).all()
    assert (lags <= 0.01501).all()
    assert 0.4 < np.mean(found.lags > 0) < 0.6
    assert 0.02 < np.mean(gaps < 0.7) < 0.12


def test_blinks_of_a_living_face_close_twice_as_fast_as_they_open() -> None:
    found = alive(3, 60.0)
    for k, onset in enumerate(found.onsets):
        times = onset + np.arange(-0.02, 0.6, 0.001)
        speed = np.diff(found.only(np.arange(len(found.onsets)) == k).at(times)[0])
        assert -3.0 < speed.max() / speed.min() < -2.0


def test_blinks_are_more_while_speaking() -> None:
    rest = len(alive(3).onsets)
    speech = len(alive(3, 3600.0, *(PhraseEnd(0.0, 2.2 * k) for k in range(1, 1636))).onsets)
    assert 22 < speech / 60 < 30  # 26 in conversation (Bentivoglio et al. 1997)
    assert speech / rest > 1.3


def test_blinks_at_one_end_of_a_phrase_are_one() -> None:
    ends = [PhraseEnd(0.0, 2.2 * k) for k in range(1, 1636)]
    found = np.sort(alive(3, 3600.0, *ends).onsets)
    for end in ends:
        assert np.sum((found >= end.at) & (found <= end.at + 0.1)) <= 1


@pytest.mark.parametrize(
    ("degrees", "least", "most"), [(15.0, 0.0, 0.0), (26.5, 0.35, 0.6), (40.0, 0.9, 1.0)]
)
def test_blinks_come_with_most_large_gaze_shifts(degrees: float, least: float, most: float) -> None:
    shifts = [GazeShift(10.0 * k, degrees) for k in range(1, 360)]
    found = alive(3, shifts=shifts).onsets
    assert least <= np.mean([shift.at in found for shift in shifts]) <= most


def test_blinks_wait_for_the_saccade_after_a_long_fixation() -> None:
    saccades = 1.5 * np.arange(2400)
    found = alive(3, saccades=saccades).onsets
    usual = alive(3).onsets
    assert np.isin(found, saccades).mean() > 0.45
    assert not np.isin(usual, saccades).any()
    short = alive(3, saccades=1.4 * np.arange(2570)).onsets
    np.testing.assert_array_equal(short, usual)


PLACES = {"left": (1.0, 0.0, 1.0), "right": (-0.5, 0.0, 1.0)}


def shifts_of(document: str, start: float = 0.0, end: float = 20.0) -> list[tuple[float, int]]:
    player = Player(PlayOptions(scene=PLACES, idle=False))
    player.submit(parse(f'<bml id="b">{document}</bml>', VOCABULARY), 0.0)
    channels, _ = player.motion(np.array([start, end]))
    return [(shift.at, round(shift.degrees)) for shift in gaze_shifts(channels, start, end)]


def test_gaze_shifts_are_the_turns_to_a_target_and_back() -> None:
    gaze = '<gaze id="a" target="left" start="1" ready="2" relax="5" end="6"/>'
    assert shifts_of(gaze) == [(1.0, 45), (5.0, 45)]
    assert shifts_of(gaze, 4.0) == [(5.0, 45)]
    assert shifts_of(gaze, 5.5) == [(5.0, 45)]
    assert shifts_of(gaze, 0.0, 0.9) == shifts_of(gaze, 7.5) == []


def test_gaze_shifts_include_lasting_ones_in_order_of_time() -> None:
    found = shifts_of(
        '<gaze id="a" target="right" start="3" relax="6" end="7"/>'
        '<gazeShift id="b" target="left" start="1" end="2"/>'
    )
    assert found == [(1.0, 45), (3.0, round(math.degrees(math.atan(0.5)))), (6.0, 27)]


def test_gaze_shifts_ignore_heads_that_nod_and_faces() -> None:
    assert shifts_of('<head id="h" lexeme="NOD"/><faceLexeme id="f" lexeme="SMILE"/>') == []


@pytest.mark.parametrize(("liveliness", "blinks"), [(0.0, False), (1.0, True)])
def test_gaze_shifts_of_over_33_degrees_come_with_a_blink(liveliness: float, blinks: bool) -> None:
    player = Player(PlayOptions(scene=PLACES, liveliness=liveliness))
    gaze = '<gaze id="a" target="left" start="1" ready="1.6" relax="5" end="6"/>'
    player.submit(parse(f'<bml id="b">{gaze}</bml>', VOCABULARY), 0.0)
    lids = player.frames(1.0 + np.arange(0.0, 0.3, 0.01)).values[:, au(45)[0].column]
    assert (lids.max() > 0.4) == blinks
