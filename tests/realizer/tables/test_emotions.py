"""What archetypes show in action units."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.emotions.wheel import wheel
from realizer.tables.emotions import archetypes, emotion_faces
from realizer.tables.lexemes import face_lexemes
from realizer.tables.profiles import own_ranges
from realizer.tables.wheel_words import ring


def test_the_archetypes_stand_on_the_wheel_in_plutchiks_order() -> None:
    names = [archetype.name for archetype in archetypes()]
    assert names == ["FEAR", "SADNESS", "SURPRISE", "DISGUST", "ANGER", "HAPPINESS"]
    angles = [archetype.angle for archetype in archetypes()]
    assert angles == sorted(set(angles))


def test_every_basic_emotion_of_the_wheel_has_a_face_and_a_profile() -> None:
    basic = {place.name for place in ring("paul").values() if place.kind == "basic"}
    assert set(emotion_faces()) == basic == {row.emotion for row in own_ranges()}


@pytest.mark.parametrize("face", emotion_faces().values(), ids=lambda face: face.emotion)
def test_a_face_is_its_lexeme_or_has_units_of_its_own(face) -> None:
    assert face.aus
    if face.lexeme:
        assert face.aus == face_lexemes()[face.lexeme].aus


@pytest.mark.parametrize("name", [place.name for place in ring("paul").values() if place.opposite])
def test_opposites_on_the_wheel_do_not_resemble_each_other(name: str) -> None:
    """Table 6.1 of Paul 2010: as FAPs, whose signs tell brows that rise from brows that fall."""
    here = ring("paul")[name]
    one, other = wheel(here.angle).frame(), wheel(ring("paul")[here.opposite].angle).frame()
    assert one @ other / (np.linalg.norm(one) * np.linalg.norm(other)) <= 0
