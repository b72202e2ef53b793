"""Tests of `realizer.tables.facial_features`."""

from __future__ import annotations

from realizer.tables import faps
from realizer.tables.facial_features import facial_features


def test_facial_features_are_15_in_the_units_of_their_faps() -> None:
    rows = facial_features()
    assert [row.number for row in rows] == list(range(1, 16))
    for row in rows:
        assert {faps()[fap - 1].unit for fap in (*row.signs, *row.also)} == {row.unit}


def test_facial_features_of_eyes_have_the_opposite_sign_of_lids() -> None:
    features = {row.number: row for row in facial_features()}
    assert features[12].signs == {19: -1, 21: -1}
    assert features[13].signs == {20: -1, 22: -1}
