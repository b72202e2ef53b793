"""The three sets of archetypes, against the print and against MPEG-4."""

from __future__ import annotations

import pytest

from realizer.emotions.archetypes import archetypes
from realizer.tables import faps

SIX = {"anger", "sadness", "joy", "disgust", "fear", "surprise"}


def test_the_published_sets_have_the_25_profiles_of_the_print() -> None:
    for profiles in ("published", "raw"):
        counts = {emotion: len(numbered) for emotion, numbered in archetypes(profiles).items()}
        assert counts == {"anger": 5, "sadness": 1, "joy": 4, "disgust": 1, "fear": 10, "surprise": 4}


def test_eyes_open_in_corrected_fear_and_surprise_and_shut_in_the_raw_ones() -> None:
    for emotion in ("fear", "surprise"):
        assert all(v > 0 for fap, v in archetypes("raw")[emotion][0].midpoint().items() if 19 <= fap <= 22)
        assert all(
            v < 0 for fap, v in archetypes("published")[emotion][0].midpoint().items() if 19 <= fap <= 22
        )
    assert archetypes("published")["joy"][1].midpoint()[19] > 0


def test_no_corrected_range_is_without_width() -> None:
    for numbered in archetypes("published").values():
        for profile in numbered.values():
            assert all(high > low for low, high in profile.ranges.values())


def test_our_own_set_has_the_eight_basic_emotions_alike_on_both_sides() -> None:
    own = archetypes("own")
    assert set(own) == SIX | {"trust", "anticipation"}
    for emotion, numbered in own.items():
        for fap, (low, high) in numbered[0].ranges.items():
            row = faps()[fap - 1]
            assert row.least <= low < high <= row.most, (emotion, fap)
            assert row.sign == 1
            assert numbered[0].ranges[row.mirror] == (low, high), (emotion, fap)


def test_another_set_is_refused() -> None:
    with pytest.raises(ValueError, match="wanted own, published, raw, got 'ekman'"):
        archetypes("ekman")
