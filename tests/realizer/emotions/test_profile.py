"""Tests of `realizer.emotions.profile`."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile, read_profiles, split_number, write_profiles

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


# Paul 2010, figure 6.5, with the ranges that he shows.
FIGURE = """\
Fear 9
F3 [400, 560], F5 [307, 399], F36 [460, 540]
Surprise 0
F3 [569, 1201], F5 [340, 746], F54 [-121,-43]
Surprise 1
F3 [1150, 1252], F5 [-792,-700], F54 [-141,-101]
"""


def test_read_profiles_reads_the_lines_of_paul() -> None:
    fear, surprise, _ = read_profiles(FIGURE)
    assert fear.name == "Fear 9"
    assert fear.ranges[5] == (307, 399)
    assert surprise.ranges[54] == (-121, -43)
    assert write_profiles(read_profiles(FIGURE)) == FIGURE.replace(",-", ", -")


@pytest.mark.parametrize("profiles", ["own", "published", "raw"])
def test_write_profiles_round_trips_every_set(profiles: str) -> None:
    every = [profile for numbered in archetypes(profiles).values() for profile in numbered.values()]
    back = read_profiles("# ours\n\n" + write_profiles(every))
    assert [p.name.lower() for p in back] == [p.name for p in every]
    assert [dict(p.ranges) for p in back] == [dict(p.ranges) for p in every]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Fear\nF3 [1, 2]", "mine, line 1: wanted an emotion and a number, got 'Fear'"),
        ("Fear 9\n", "mine: wanted a line of ranges after 'Fear 9', got the end"),
        ("Fear 9\nF3 [1, 2]\n\nFear 9\nF3 [1, 2]", "mine, line 4: Fear 9 is there twice"),
        ("Fear 9\n\nF3 [1 2]", "mine, line 3: Fear 9, column 1: wanted F3"),
        ("Fear 9\nSurprise 0\n", "mine, line 2: Fear 9, column 1: wanted F3"),
    ],
)
def test_read_profiles_refuses_an_invalid_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_profiles(text, "mine")


def test_split_number_of_names_without_one_is_none() -> None:
    assert split_number("fear 8") == ("fear", 8)
    assert split_number("neutral") == ("neutral", None)
    assert split_number("8") == ("8", None)
