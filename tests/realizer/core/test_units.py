"""Tests of `realizer.core.units`."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.units import frame_count


@pytest.mark.parametrize(
    ("duration", "fps", "frames"),
    [(0, 25, 1), (1, 25, 26), (0.999, 25, 25), (0.1 + 0.2, 10, 4), (2.5, 30, 76)],
)
def test_frame_count_includes_both_ends(duration: float, fps: float, frames: int) -> None:
    assert frame_count(duration, fps) == frames


@given(st.floats(0, 1000), st.floats(1, 120))
def test_frame_count_has_its_last_frame_near_the_end(duration: float, fps: float) -> None:
    last = (frame_count(duration, fps) - 1) / fps
    assert last <= duration + 1e-5
    assert duration - last < 1 / fps + 1e-6
