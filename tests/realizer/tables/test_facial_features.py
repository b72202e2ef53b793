"""The 15 features of feature points."""

from __future__ import annotations

from realizer.tables import faps
from realizer.tables.facial_features import facial_features


def test_there_are_15_and_each_is_in_the_unit_of_its_faps() -> None:
    rows = facial_features()
    assert [row.number for row in rows] == list(range(1, 16))
    for row in rows:
        assert {faps()[fap - 1].unit for fap in (*row.signs, *row.also)} == {row.unit}


def test_the_eyes_openness_counts_against_closing_lids() -> None:
    features = {row.number: row for row in facial_features()}
    assert features[12].signs == {19: -1, 21: -1}
    assert features[13].signs == {20: -1, 22: -1}
