"""Tests of `realizer.tables.wheel_words`."""

from __future__ import annotations

import math

import pytest

from realizer.tables.wheel_words import own_words, ring, whissell_words


def test_whissell_words_are_those_of_the_paper() -> None:
    words = whissell_words()
    assert len(words) == 14
    assert (words["sad"].raw_activation, words["sad"].activation) == (3.8, 3.9)
    assert words["accepting"].activation is None
    assert words["guilty"].angle == 102.3
    assert {row.category for row in words.values()} - {""} <= set(ring("plutchik"))


def test_ring_of_paul_has_opposites_at_180_degrees() -> None:
    places = ring("paul")
    assert len(places) == 16
    for place in places.values():
        other = places[place.opposite]
        assert other.opposite == place.name
        assert (place.angle - other.angle) % 360 == 180
        assert place.kind == other.kind


def test_ring_has_advanced_emotions_in_the_middle_of_two_others() -> None:
    places = ring("paul")
    for place in places.values():
        if place.kind == "advanced":
            one, two = (places[name].angle for name in place.between.split("+"))
            assert (one + ((two - one) % 360) / 2) % 360 == place.angle


def test_ring_of_affect_follows_the_ratings_of_words() -> None:
    for row in whissell_words().values():
        if row.category and row.word not in ("terrified", "worried"):
            angle = math.degrees(math.atan2(row.activation - 4, row.evaluation - 4)) % 360
            assert ring("affect")[row.category].angle == pytest.approx(angle, abs=0.06)


def test_own_words_stand_for_known_words_and_hide_none() -> None:
    known = {*whissell_words(), *ring("paul")}
    assert {row.like for row in own_words().values()} <= known
    assert not set(own_words()) & known
