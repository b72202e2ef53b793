"""Tests of `realizer.tables.emotions`."""

import math

import numpy as np
import pytest

from realizer.emotions.wheel import wheel
from realizer.tables import toml_table
from realizer.tables.emotions import (
    emotion_faces,
    emotion_model,
    own_ranges,
    own_words,
    published_ranges,
    ring,
    statistics,
    whissell_words,
)
from realizer.tables.lexemes import face_lexemes
from tests import own_profiles


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


def test_ring_of_plutchik_has_the_archetypes_in_his_order() -> None:
    rated = [place for place in ring("plutchik").values() if place.activation is not None]
    names = [emotion_faces()[place.name].lexeme for place in rated]
    assert names == ["FEAR", "SADNESS", "SURPRISE", "DISGUST", "ANGER", "HAPPINESS"]
    angles = [place.angle for place in rated]
    assert angles == sorted(set(angles))


def test_emotion_faces_have_every_basic_emotion_with_a_profile() -> None:
    basic = {place.name for place in ring("paul").values() if place.kind == "basic"}
    assert set(emotion_faces()) == basic == {row.emotion for row in own_ranges()}


@pytest.mark.parametrize("face", emotion_faces().values(), ids=lambda face: face.emotion)
def test_emotion_faces_are_lexemes_or_have_their_own_units(face) -> None:
    assert face.aus
    if face.lexeme:
        assert face.aus == face_lexemes()[face.lexeme].aus


@pytest.mark.parametrize("name", [place.name for place in ring("paul").values() if place.opposite])
def test_emotion_faces_of_opposites_are_different(name: str) -> None:
    """Table 6.1 of Paul 2010: brows go the other way, though both mouths of fear and anger are open."""
    here = ring("paul")[name]
    one, other = wheel(here.angle).frame(), wheel(ring("paul")[here.opposite].angle).frame()
    assert one @ other / (np.linalg.norm(one) * np.linalg.norm(other)) < 0.4
    assert one[30:36] @ other[30:36] <= 0


def test_emotion_model_chooses_a_profile_of_every_published_emotion() -> None:
    there = {(row.emotion, row.profile) for row in published_ranges()}
    assert set(emotion_model().chosen.items()) <= there
    assert set(emotion_model().chosen) == {emotion for emotion, _ in there}


def test_emotion_model_recognises_within_lengths_above_0() -> None:
    model = emotion_model()
    assert 0 < model.least_belief < 1
    assert all(3 <= fap <= 68 for fap in model.unjudged)
    assert min(model.least_length, model.absent, *model.strengths) > 0


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
