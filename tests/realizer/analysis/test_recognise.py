"""Tests of `realizer.analysis.recognise`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.analysis.recognise import Recogniser, recogniser
from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile
from realizer.emotions.words import emotion, known_words
from realizer.tables.emotion_model import emotion_model
from realizer.tables.wheel_words import ring

DRAWS = 60


def noisy(profile: Profile, seed: int) -> np.ndarray:
    """Draws with a noise of one tenth of each range; of a FAP that is absent, of its class."""
    chance = np.random.default_rng(seed)
    lengths = np.full(68, 2 * emotion_model().absent)
    for fap, (low, high) in profile.ranges.items():
        lengths[fap - 1] = high - low
    draws = np.stack([profile.draw(chance) for _ in range(DRAWS)])
    return draws + chance.normal(0, 0.1 * lengths, draws.shape)


def test_beliefs_fall_from_the_range_to_half_a_length_beyond() -> None:
    known = Recogniser([Profile.parse("F31 [100, 200]", "up 0")])
    frames = np.zeros((7, 68))
    frames[:, 30] = 50, 75, 100, 150, 200, 225, 250
    assert known.beliefs(frames)[:, 0] == pytest.approx([0, 0.5, 1, 1, 1, 0.5, 0])


def test_beliefs_are_products_and_emotions_have_the_best_profile() -> None:
    known = Recogniser(
        [
            Profile.parse("F31 [100, 200], F32 [100, 200]", "up 0"),
            Profile.parse("F31 [150, 250], F32 [150, 250]", "up 1"),
            Profile.parse("F31 [-200, -100]", "down 0"),
        ]
    )
    frame = np.zeros(68)
    frame[30:32] = 225
    seen = known.recognise(frame)
    assert seen.profiles == pytest.approx({"up 0": 0.25, "up 1": 1, "down 0": 0})
    assert seen.emotions == pytest.approx({"up": 1, "down": 0})
    assert seen.emotion == "up"


def test_beliefs_without_absent_faps_find_a_small_profile_in_a_larger() -> None:
    small, large = (
        Profile.parse("F31 [100, 200]", "small"),
        Profile.parse("F31 [100, 200], F4 [90, 110]", "large"),
    )
    frame = large.frame()
    published, ours = Recogniser([small, large], absent=False), Recogniser([small, large])
    assert published.recognise(frame).emotions == {"small": 1, "large": 1}
    assert published.recognise(frame).emotion == "large"  # alike in belief: the one that asks for more
    assert ours.recognise(frame).emotions == {"small": 0, "large": 1}
    assert ours.recognise(small.frame()).emotion == "small"


def test_beliefs_ignore_unobserved_faps() -> None:
    known = Recogniser(
        [Profile.parse("F31 [100, 200], F4 [90, 110]", "a"), Profile.parse("F5 [50, 60]", "b")]
    )
    frame, seen = np.zeros(68), np.zeros(68, bool)
    frame[30], seen[30] = 150, True
    assert known.recognise(frame, seen).emotion == "a"
    assert known.recognise(frame, np.zeros(68, bool)).emotion is None


@pytest.mark.parametrize("profiles", ["own", "published", "raw"])
def test_recogniser_recognises_the_neutral_face(profiles: str) -> None:
    assert recogniser(profiles).recognise(np.zeros(68)).emotion == "neutral"
    assert "neutral" not in recogniser(profiles, absent=False).recognise(np.zeros(68)).emotions


@pytest.mark.parametrize("profiles", ["own", "published"])
def test_recogniser_recognises_archetypes_through_noise(profiles: str) -> None:
    known = recogniser(profiles)
    for name, numbered in archetypes(profiles).items():
        for profile in numbered.values():
            right = sum(got == name for got in known.names(noisy(profile, 7)))
            assert right >= 0.95 * DRAWS, profile.name


@pytest.mark.parametrize("strength", [0.4, 0.5, 0.56, 0.7, 0.85, 1.1])
def test_recogniser_recognises_our_own_archetypes_at_less_strength(strength: float) -> None:
    known = recogniser()
    for name, numbered in archetypes().items():
        weaker = numbered[0].scaled(strength)
        assert known.recognise(weaker.frame()).emotion == name, weaker
        right = sum(got == name for got in known.names(noisy(weaker, 3)))
        assert right >= 0.9 * DRAWS, name


@pytest.mark.parametrize("name", [place.name for place in ring("paul").values() if place.kind == "advanced"])
def test_recogniser_names_a_blend_of_two_archetypes(name: str) -> None:
    seen = recogniser().recognise(emotion(name).frame())
    assert seen.emotion == name
    assert seen.emotions[name] == 1


def test_recogniser_recognises_a_word_as_its_archetype() -> None:
    known = recogniser()
    wanted = {"sad": "sadness", "afraid": "fear", "angry": "anger", "disgusted": "disgust", "happy": "joy"}
    assert {word: known.recognise(emotion(word).frame()).emotion for word in wanted} == wanted
    assert known.recognise(emotion("terrified").frame()).emotion == "fear"


@pytest.mark.parametrize("profiles", ["own", "published"])
def test_recogniser_distinguishes_words_through_noise(profiles: str) -> None:
    words = [word for word, source in known_words().items() if source == "whissell"]
    made = [emotion(word, profiles) for word in words]
    known = Recogniser(made)
    right = {p.name: sum(got == p.name for got in known.names(noisy(p, 7))) / DRAWS for p in made}
    assert np.mean(list(right.values())) >= 0.95
    # Delighted and eager overlap: both are mostly joy, by 7 degrees and four fifths of an activation.
    assert min(right.values()) >= 0.85, right


def test_beliefs_refuse_invalid_frames() -> None:
    with pytest.raises(ValueError, match="wanted at least one"):
        Recogniser([])
    with pytest.raises(ValueError, match=r"wanted \(n, 68\), got \(2, 15\)"):
        recogniser().beliefs(np.zeros((2, 15)))
    with pytest.raises(ValueError, match="finite"):
        recogniser().beliefs(np.full((1, 68), np.nan))
