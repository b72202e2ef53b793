"""Tests of `realizer.tables.profiles`."""

from __future__ import annotations

import pytest

from realizer.tables import toml_table
from realizer.tables.profiles import published_ranges, statistics
from tests import own_profiles


def test_published_ranges_of_first_profiles_follow_the_statistics() -> None:
    measured = {(row.emotion, row.fap): row for row in statistics() if row.mean is not None}
    seen = 0
    for row in published_ranges():
        if row.profile or row.fault == "misprint":
            continue
        stat = measured[row.emotion, row.fap]
        for mean, low, high in ((stat.raw_mean, row.raw_low, row.raw_high), (stat.mean, row.low, row.high)):
            # Their surprise is rounded more freely than the rest.
            assert (mean - stat.deviation, mean + stat.deviation) == pytest.approx((low, high), abs=2), row
        seen += 1
    assert seen == 57


def test_published_ranges_with_misprints_contradict_the_statistics() -> None:
    measured = {(row.emotion, row.fap): row for row in statistics() if row.mean is not None}
    wrong = [row for row in published_ranges() if row.fault == "misprint"]
    assert [(row.emotion, row.fap) for row in wrong] == [("anger", 31), ("disgust", 33), ("disgust", 34)]
    for row in wrong:
        stat = measured[row.emotion, row.fap]
        assert (row.low, row.high) == (stat.mean - stat.deviation, stat.mean + stat.deviation)
        assert (row.raw_low, row.raw_high) != (row.low, row.high)


def vocabularies(raw: bool = False) -> dict[str, set[int]]:
    """Return emotion -> FAPs that its expressions may move (Raouzaiou et al. 2002, table 2)."""
    table = toml_table("vocabularies.toml")
    rows = table["raw"] if raw else table["raw"] | table["corrected"]
    return {emotion: set(faps) for emotion, faps in rows.items()}


def test_vocabularies_have_every_verified_fap() -> None:
    known = vocabularies()
    outside = {(row.emotion, row.fap) for row in statistics() if row.mean is not None} - {
        (emotion, fap) for emotion, faps in known.items() for fap in faps
    }
    assert not outside


def test_vocabularies_correct_only_fear() -> None:
    raw, known = vocabularies(raw=True), vocabularies()
    assert {emotion for emotion in known if known[emotion] != raw[emotion]} == {"fear"}
    assert known["fear"] - raw["fear"] == {19}
    assert raw["fear"] - known["fear"] == {12}


def test_own_ranges_follow_from_the_faces_of_the_emotions() -> None:
    assert own_profiles.FILE.read_text("utf-8") == own_profiles.render(), "python -m tests.own_profiles"
