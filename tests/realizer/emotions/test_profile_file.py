"""Tests of `realizer.emotions.profile_file`."""

from __future__ import annotations

import pytest

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile_file import read_profiles, write_profiles

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
