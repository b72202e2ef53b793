"""Tests of `realizer_studio.analysis.statistics`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.emotions.archetypes import archetypes
from realizer.tables.emotions import statistics
from realizer_studio.analysis.statistics import from_faces, from_statistics


def published_statistics(emotion: str, raw: bool = False) -> dict[int, tuple[float, float]]:
    """Return FAP -> (mean, deviation) of an emotion (table 4), as printed or with the signs of MPEG-4."""
    found = {}
    for row in statistics():
        mean = row.raw_mean if raw else row.mean
        if row.emotion == emotion and mean is not None and row.deviation is not None:
            found[row.fap] = mean, row.deviation
    return found


@pytest.mark.parametrize(("profiles", "raw"), [("raw", True), ("published", False)])
@pytest.mark.parametrize("emotion", ["anger", "sadness", "joy", "disgust", "fear", "surprise"])
def test_from_statistics_gives_the_first_published_profile(emotion: str, profiles: str, raw: bool) -> None:
    made = from_statistics(emotion, published_statistics(emotion, raw))
    printed = archetypes(profiles)[emotion][0]
    assert made.ranges.keys() == printed.ranges.keys()
    for fap, ends in printed.ranges.items():
        # Anger's F31 and disgust's F33 and F34 are misprinted by 10.
        assert made.ranges[fap] == pytest.approx(ends, abs=10 if raw else 2), fap


def test_from_statistics_keeps_the_direction_of_a_fap() -> None:
    made = from_statistics("sigh", {3: (100, 150), 41: (-10, 5), 4: (100, 150)})
    assert dict(made.ranges) == {3: (0, 250), 4: (-50, 250), 41: (0, 0)}


def test_from_faces_of_a_profile_gives_ranges_within_it() -> None:
    joy = archetypes("own")["joy"][0]
    chance = np.random.default_rng(0)
    made = from_faces("joy", np.stack([joy.draw(chance) for _ in range(400)]))
    assert made.ranges.keys() == joy.ranges.keys()
    for fap, (low, high) in joy.ranges.items():
        # A uniform draw deviates by its width / sqrt(12).
        deviation = (high - low) / 12**0.5
        middle = (low + high) / 2
        assert made.ranges[fap] == pytest.approx(
            (middle - deviation, middle + deviation), abs=0.1 * (high - low)
        )


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        (np.zeros((1, 68)), r"at least two faces \(n, 68\), got \(1, 68\)"),
        (np.zeros((4, 15)), r"at least two faces \(n, 68\), got \(4, 15\)"),
        (np.full((4, 68), np.nan), "finite values"),
    ],
)
def test_from_faces_refuses_invalid_frames(frames: np.ndarray, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        from_faces("x", frames)


def test_from_statistics_refuses_an_invalid_deviation() -> None:
    with pytest.raises(ValueError, match="x, FAP 4: wanted a deviation of 0 or more, got -1"):
        from_statistics("x", {4: (3, -1)})
