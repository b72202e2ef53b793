"""Tests of `realizer.core.options`."""

from __future__ import annotations

import math

import pytest

from realizer.core.options import PlayOptions


@pytest.mark.parametrize("fps", [0.0, -1.0, math.nan, math.inf])
def test_play_options_refuse_a_rate_that_is_not_above_0(fps: float) -> None:
    with pytest.raises(ValueError, match="fps: wanted a number above 0"):
        PlayOptions(fps=fps)


def test_play_options_are_25_frames_a_second_with_idle_motion_by_default() -> None:
    assert (PlayOptions().fps, PlayOptions().idle, PlayOptions().prosody) == (25.0, True, True)


@pytest.mark.parametrize("liveliness", [-0.1, 1.1, math.nan])
def test_play_options_refuse_a_liveliness_outside_0_to_1(liveliness: float) -> None:
    with pytest.raises(ValueError, match=r"liveliness: wanted a number 0\.\.1"):
        PlayOptions(liveliness=liveliness)
