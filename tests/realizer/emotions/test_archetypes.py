"""Tests of `realizer.emotions.archetypes`."""

from __future__ import annotations

import pytest

from realizer.emotions.archetypes import archetypes
from realizer.tables import faps

SIX = {"anger", "sadness", "joy", "disgust", "fear", "surprise"}


def test_archetypes_have_the_25_published_profiles() -> None:
    for profiles in ("published", "raw"):
        counts = {emotion: len(numbered) for emotion, numbered in archetypes(profiles).items()}
        assert counts == {"anger": 5, "sadness": 1, "joy": 4, "disgust": 1, "fear": 10, "surprise": 4}


def test_archetypes_open_eyes_in_corrected_fear_and_surprise() -> None:
    for emotion in ("fear", "surprise"):
        assert all(v > 0 for fap, v in archetypes("raw")[emotion][0].midpoint().items() if 19 <= fap <= 22)
        assert all(
            v < 0 for fap, v in archetypes("published")[emotion][0].midpoint().items() if 19 <= fap <= 22
        )
    assert archetypes("published")["joy"][1].midpoint()[19] > 0


def test_archetypes_have_no_corrected_range_without_width() -> None:
    for numbered in archetypes("published").values():
        for profile in numbered.values():
            assert all(high > low for low, high in profile.ranges.values())


def test_archetypes_of_our_own_are_eight_and_symmetric() -> None:
    own = archetypes("own")
    assert set(own) == SIX | {"trust", "anticipation"}
    for emotion, numbered in own.items():
        for fap, (low, high) in numbered[0].ranges.items():
            row = faps()[fap - 1]
            assert row.least <= low < high <= row.most, (emotion, fap)
            assert row.sign == 1
            assert numbered[0].ranges[row.mirror] == (low, high), (emotion, fap)


def test_archetypes_refuse_an_unknown_set() -> None:
    with pytest.raises(ValueError, match="wanted own, published, raw, got 'ekman'"):
        archetypes("ekman")
