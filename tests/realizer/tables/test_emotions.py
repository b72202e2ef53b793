"""Tests of `realizer.tables.emotions`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.emotions.wheel import wheel
from realizer.tables.emotions import archetypes, emotion_faces
from realizer.tables.lexemes import face_lexemes
from realizer.tables.profiles import own_ranges
from realizer.tables.wheel_words import ring


def test_archetypes_have_the_order_of_plutchik() -> None:
    names = [archetype.name for archetype in archetypes()]
    assert names == ["FEAR", "SADNESS", "SURPRISE", "DISGUST", "ANGER", "HAPPINESS"]
    angles = [archetype.angle for archetype in archetypes()]
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
