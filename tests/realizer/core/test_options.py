"""Tests of `realizer.core.options`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realizer.core.options import PlayOptions


@pytest.mark.parametrize("fps", [0.0, -1.0, math.nan, math.inf])
def test_play_options_refuse_a_rate_that_is_not_above_0(fps: float) -> None:
    with pytest.raises(ValueError, match="fps: wanted a number above 0"):
        PlayOptions(fps=fps)


def test_play_options_are_25_frames_a_second_with_idle_motion_by_default() -> None:
    assert (PlayOptions().fps, PlayOptions().idle, PlayOptions().prosody) == (25.0, True, True)


@pytest.mark.parametrize(("name", "most"), [("liveliness", 1), ("jaw", 2), ("lips", 2)])
def test_play_options_refuse_numbers_out_of_range(name: str, most: int) -> None:
    for value in (-0.1, most + 0.1, math.nan):
        with pytest.raises(ValueError, match=rf"{name}: wanted a number 0\.\.{most}, got {value}"):
            PlayOptions(**{name: value})
    assert getattr(PlayOptions(**{name: most}), name) == most


@pytest.mark.parametrize(("name", "least"), [("grace", 0), ("max_planning", 1)])
def test_play_options_refuse_limits_below_the_least(name: str, least: int) -> None:
    with pytest.raises(ValueError, match=f"{name}: wanted a number of at least {least}, got {least - 1}"):
        PlayOptions(**{name: least - 1})
    assert getattr(PlayOptions(**{name: least}), name) == least


def test_play_options_take_numbers_of_numpy() -> None:
    options = PlayOptions(seed=np.int64(3), fps=np.float32(30))  # type: ignore[arg-type]
    assert (type(options.seed), type(options.fps)) == (int, float)
