"""The wheel's table."""

from __future__ import annotations

import pytest

from realizer.tables.emotions import archetypes, words


def test_the_archetypes_stand_on_the_wheel_in_plutchiks_order() -> None:
    names = [archetype.name for archetype in archetypes()]
    assert names == ["FEAR", "SADNESS", "SURPRISE", "DISGUST", "ANGER", "HAPPINESS"]
    angles = [archetype.angle for archetype in archetypes()]
    assert angles == sorted(set(angles))


@pytest.mark.parametrize("word", words().values(), ids=lambda word: word.name)
def test_every_word_is_upper_case_and_leads_to_a_face(word) -> None:
    assert word.name == word.name.upper()
    assert (word.like is None) != (word.angle is None)
    assert word.activation is None or 1 <= word.activation <= 7
