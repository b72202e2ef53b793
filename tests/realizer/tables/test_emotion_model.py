"""The numbers of wheel and recogniser."""

from __future__ import annotations

from realizer.tables.emotion_model import emotion_model
from realizer.tables.profiles import published_ranges


def test_every_published_emotion_has_one_of_its_profiles_chosen() -> None:
    there = {(row.emotion, row.profile) for row in published_ranges()}
    assert set(emotion_model().chosen.items()) <= there
    assert set(emotion_model().chosen) == {emotion for emotion, _ in there}
