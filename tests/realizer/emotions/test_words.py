"""Tests of `realizer.emotions.words`."""

from pathlib import Path

import numpy as np
import pytest

from realizer.emotions.archetypes import archetypes
from realizer.emotions.wheel import wheel
from realizer.emotions.words import UnknownWordError, WordPlace, emotion, known_words, place_of, strength_of


@pytest.mark.parametrize("profiles", ["own", "published", "raw"])
def test_emotion_has_a_profile_for_every_known_word(profiles: str) -> None:
    for word in known_words():
        made = emotion(word, profiles)
        assert made.name == word
        assert made.source == profiles
        assert made.frame().any() != (word == "neutral")


def test_known_words_name_their_source() -> None:
    sources = known_words()
    assert (sources["remorse"], sources["guilty"], sources["scared"]) == ("wheel", "whissell", "own")
    assert "accepting" not in sources
    assert emotion("scared").ranges == emotion("afraid").ranges


def test_emotion_of_the_wheel_is_its_archetype() -> None:
    anger = archetypes("own")["anger"][0]
    assert emotion("Anger").ranges == anger.ranges
    assert emotion(" ANGRY ").ranges[31] == pytest.approx(anger.ranges[31])
    assert emotion("anger", "published").ranges == archetypes("published")["anger"][3].ranges
    assert emotion("angry", "published").ranges == archetypes("published")["anger"][3].ranges


def test_emotion_of_a_category_is_scaled_by_activation() -> None:
    afraid, worried, terrified = (emotion(word).frame() for word in ("afraid", "worried", "terrified"))
    assert np.allclose(worried * 4.9, afraid * 3.9, atol=1e-2)
    assert np.allclose(terrified * 4.9, afraid * 6.3, atol=1e-2)


@pytest.mark.parametrize("word", ["terrified", "sad", "guilty", "delighted", "bashful", "anger", "remorse"])
def test_emotion_of_our_own_set_has_the_strength_of_documents(word: str) -> None:
    place = place_of(word)
    assert place is not None
    wanted = wheel(place.angle, None, "own", place.ring).scaled(strength_of(place))
    assert np.allclose(emotion(word).frame(), wanted.frame())
    assert strength_of(place) == pytest.approx(1.0, abs=0.6)
    assert strength_of(WordPlace("paul", 45.0)) == 1.0


def test_emotion_terrified_is_stronger_than_fear_and_worried_weaker() -> None:
    fear = emotion("fear").frame()
    assert np.allclose(emotion("terrified").frame(), fear * 6.3 / 4.9, atol=1e-2)
    assert np.allclose(emotion("worried").frame(), fear * 3.9 / 4.9, atol=1e-2)


def test_emotion_with_a_number_is_that_profile() -> None:
    assert emotion("fear 3", "raw") is archetypes("raw")["fear"][3]
    with pytest.raises(UnknownWordError):
        emotion("fear 33", "raw")


@pytest.mark.parametrize("profiles", ["own", "published"])
def test_emotion_of_plutchiks_rings_is_milder_or_stronger(profiles: str) -> None:
    joy = emotion("joy", profiles).frame()
    assert np.allclose(emotion("serenity", profiles).frame(), joy * 0.5, atol=1e-2)
    assert np.allclose(emotion("ecstasy", profiles).frame(), joy * 1.25, atol=1e-2)


def test_emotion_of_a_profile_file_is_its_first_profile(tmp_path: Path) -> None:
    path = tmp_path / "two.txt"
    path.write_text("Fear 9\nF3 [400, 560]\nSurprise 0\nF3 [600, 1000]\nSmug 0\nF12 [100, 200]\n")
    profiles = str(path)
    assert emotion("fear", profiles).ranges == emotion("fear 9", profiles).ranges == {3: (400, 560)}
    assert emotion("Smug", profiles).ranges == {12: (100, 200)}
    assert emotion("awe", profiles).ranges == {3: (500, 780)}
    assert wheel(247.5, None, profiles).name == "neutral"
    with pytest.raises(UnknownWordError, match="wanted one of fear, surprise, smug"):
        emotion("joy", profiles)


def test_emotion_uses_the_chosen_profiles() -> None:
    usual, chosen = (emotion("guilty", f"published{more}").ranges for more in ("", ", fear 3"))
    assert usual != chosen
    assert emotion("fear", "published, fear 3").ranges == emotion("fear 3", "published").ranges


def test_place_of_a_word_between_archetypes_is_on_plutchiks_ring() -> None:
    guilty, place = emotion("guilty").ranges, wheel(102.3, None, "own", "plutchik").ranges
    near_sad = (102.3 - 70.3) / (108.5 - 70.3)
    strength = 4 / (near_sad * 3.9 + (1 - near_sad) * 4.9)
    assert guilty[31] == pytest.approx([end * strength for end in place[31]])
    assert set(emotion("guilty", "published").ranges) < {3, 5, *range(19, 23), *range(31, 37)}


def test_emotion_suggests_words_for_an_unknown_one() -> None:
    with pytest.raises(UnknownWordError, match="got 'gilty', did you mean guilty"):
        emotion("Gilty")
    with pytest.raises(UnknownWordError, match=r"wanted one of .*afraid.*; got 'радость'"):
        emotion("радость")
    with pytest.raises(UnknownWordError, match="got ''"):
        emotion("  ")
    with pytest.raises(UnknownWordError) as caught:
        emotion("x" * 10_000)
    assert len(str(caught.value)) < 1000


def test_emotion_refuses_a_word_without_activation() -> None:
    with pytest.raises(ValueError, match="accepting: its activation was never rated"):
        emotion("accepting")
