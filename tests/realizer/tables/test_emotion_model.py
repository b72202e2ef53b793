"""Tests of `realizer.tables.emotion_model`."""

from __future__ import annotations

from realizer.tables.emotion_model import emotion_model
from realizer.tables.profiles import published_ranges


def test_emotion_model_chooses_a_profile_of_every_published_emotion() -> None:
    there = {(row.emotion, row.profile) for row in published_ranges()}
    assert set(emotion_model().chosen.items()) <= there
    assert set(emotion_model().chosen) == {emotion for emotion, _ in there}


def test_emotion_model_recognises_within_lengths_above_0() -> None:
    model = emotion_model()
    assert 0 < model.least_belief < 1
    assert all(3 <= fap <= 68 for fap in model.unjudged)
    assert min(model.least_length, model.absent, *model.strengths) > 0
