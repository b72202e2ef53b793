"""Tests of `realizer.emotions.profile`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile

FEAR = "F3 [400, 560], F5 [-240, -160], F31 [460, 540], F32 [460, 540]"


def test_parse_and_str_are_inverse() -> None:
    profile = Profile.parse(FEAR, "fear 3")
    assert profile.ranges[5] == (-240, -160)
    assert str(profile) == FEAR
    assert Profile.parse(str(profile), "fear 3") == profile


def test_frame_has_the_middle_of_each_range() -> None:
    frame = Profile.parse(FEAR).frame()
    assert frame.dtype == np.float32
    assert frame.shape == (68,)
    assert dict(enumerate(frame, 1)) == dict.fromkeys(range(1, 69), 0) | {3: 480, 5: -200, 31: 500, 32: 500}


@given(st.integers(0, 2**32), st.sampled_from(["own", "published", "raw"]))
def test_draw_stays_within_ranges_and_repeats_for_a_seed(seed: int, profiles: str) -> None:
    for numbered in archetypes(profiles).values():
        for profile in numbered.values():
            frame = profile.draw(seed)
            for fap, (low, high) in profile.ranges.items():
                assert low - 1e-3 <= frame[fap - 1] <= high + 1e-3
            assert np.array_equal(frame, profile.draw(seed))


def test_draw_with_a_generator_varies() -> None:
    chance, profile = np.random.default_rng(1), Profile.parse(FEAR)
    assert not np.array_equal(profile.draw(chance), profile.draw(chance))


def test_draw_keeps_sides_and_lips_together() -> None:
    joy = archetypes("own")["joy"][0]
    for seed in range(20):
        frame = joy.draw(seed)
        parts = {
            fap: (frame[fap - 1] - low) / (high - low)
            for fap, (low, high) in joy.ranges.items()
            if fap in (12, 13, 59, 60)
        }
        assert max(parts.values()) - min(parts.values()) < 1e-4


def test_scaled_multiplies_both_ends() -> None:
    assert Profile.parse(FEAR).scaled(0.5).ranges[3] == (200, 280)
    with pytest.raises(ValueError, match="factor of 0 or more, got nan"):
        Profile.parse(FEAR).scaled(float("nan"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("F3 [1, 2], F3 [1, 2]", "each FAP once, got F3 twice"),
        ("F3 [1, x]", r"F3: wanted two numbers, got 'F3 \[1, x\]'"),
        ("F3 [1, 2]; F4 [1, 2]", "column 10: wanted a comma"),
        ("F3 1, 2", r"column 1: wanted F3 \[low, high\], got 'F3 1, 2'"),
        ("F2 [1, 2]", "wanted a FAP 3..68, got 2"),
        ("F69 [1, 2]", "wanted a FAP 3..68, got 69"),
        ("F3 [1, nan]", "FAP 3: wanted low <= high, finite"),
    ],
)
def test_parse_refuses_an_invalid_text_with_its_place(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Profile.parse(text)
