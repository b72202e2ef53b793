"""Tests of `realizer_studio.analysis.recognise`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.axis import au_row
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile
from realizer.emotions.words import emotion, known_words
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.tables.emotions import emotion_model, ring
from realizer_studio.analysis.faps_from_points import faps_from_points
from realizer_studio.analysis.recognise import Recogniser, emotion_of, recogniser
from tests.mesh_features import features_from_mesh, measurable_profile, points_of

DRAWS = 60


def noisy(profile: Profile, seed: int) -> np.ndarray:
    """Draws with a noise of one tenth of each range; of a FAP that is absent, of its class."""
    chance = np.random.default_rng(seed)
    lengths = np.full(68, 2 * emotion_model().absent)
    for fap, (low, high) in profile.ranges.items():
        lengths[fap - 1] = high - low
    draws = np.stack([profile.draw(chance) for _ in range(DRAWS)])
    return draws + chance.normal(0, 0.1 * lengths, draws.shape)


def name_of(known: Recogniser, frame: np.ndarray, seen: np.ndarray | None = None) -> str | None:
    return known.names(frame[None], seen)[0]


def tracked(frames: np.ndarray, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """FAPs of the feature points of ada, with noise as a part of the height of her head."""
    face, chance = load_face("ada"), np.random.default_rng(0)
    rest = {name: face.vertices[index] for name, index in face.feature_points.items()}
    size = noise * (rest["11.4"][1] - rest["2.1"][1])
    points = points_of(face, deform(face, frames.astype(np.float32)))
    moved = {name: at + chance.normal(0, size, at.shape) for name, at in points.items()}
    return faps_from_points(moved, rest, face.fapu)


def test_beliefs_fall_with_the_distance_from_the_range() -> None:
    known = Recogniser([Profile.parse("F31 [100, 200]", "up 0")])
    frames = np.zeros((5, 68))
    frames[:, 30] = 26, 100, 150, 200, 274  # 74 is half of the range and the noise of landmarks
    assert known.beliefs(frames)[:, 0] == pytest.approx([0.5, 1, 1, 1, 0.5])


def test_beliefs_are_of_the_best_profile_and_forgive_one_fap() -> None:
    known = Recogniser(
        [
            Profile.parse("F31 [100, 200], F32 [100, 200]", "up 0"),
            Profile.parse("F31 [150, 250], F32 [150, 250]", "up 1"),
            Profile.parse("F31 [-200, -100]", "down 0"),
        ]
    )
    frame = np.zeros(68)
    frame[30:32] = 225
    assert known.beliefs(frame[None])[0] == pytest.approx([1 / (1 + (25 / 74) ** 2), 1, 0.1], abs=0.01)
    assert name_of(known, frame) == "up"
    frame[31] = 5000
    assert known.beliefs(frame[None])[0, 1] == pytest.approx(1 / (1 + 9 / 2))


def test_beliefs_of_a_small_profile_suffer_from_faps_of_a_larger() -> None:
    small, large = (
        Profile.parse("F31 [100, 200]", "small"),
        Profile.parse("F31 [100, 200], F4 [90, 110]", "large"),
    )
    known = Recogniser([small, large])
    assert name_of(known, large.frame()) == "large"
    assert name_of(known, small.frame()) == "small"


def test_beliefs_ignore_faps_that_no_point_tells_of() -> None:
    known = Recogniser([Profile.parse("F31 [100, 200]", "a"), Profile.parse("F14 [90, 110]", "b")])
    frame = np.zeros(68)
    frame[[13, 30]] = -800, 150
    assert known.beliefs(frame[None])[0, 0] == 1


def test_beliefs_ignore_unobserved_faps() -> None:
    known = Recogniser(
        [Profile.parse("F31 [100, 200], F4 [90, 110]", "a"), Profile.parse("F5 [50, 60]", "b")]
    )
    frame, seen = np.zeros(68), np.zeros(68, bool)
    frame[30], seen[30] = 150, True
    assert name_of(known, frame, seen) == "a"
    assert name_of(known, frame, np.zeros(68, bool)) is None


def test_recogniser_names_archetypes_from_points_without_noise() -> None:
    names = list(archetypes())
    values, seen = tracked(np.stack([archetypes()[name][0].frame() for name in names]))
    assert recogniser().names(values, seen) == names


@pytest.mark.parametrize("name", ["joy", "anger", "surprise", "sadness", "fear", "disgust"])
def test_intervals_name_archetypes_through_noise_of_landmarks(name: str) -> None:
    values, seen = tracked(np.repeat(archetypes()[name][0].frame()[None], 50, axis=0), 0.01)
    found = recogniser().intervals(values, 25, seen)
    assert sum(i.end - i.start for i in found if i.emotion == name) >= 1.8, found


def test_intervals_have_times_and_certainties() -> None:
    joy, fear = (archetypes()[name][0].frame() for name in ("joy", "fear"))
    still = np.zeros(68)
    frames = np.stack([*[still] * 20, *[joy] * 30, *[fear] * 30])
    found = recogniser().intervals(frames, 20)
    assert [i.emotion for i in found if i.end - i.start > 0.3] == ["neutral", "joy", "fear"]
    assert found[0].start == 0
    assert [a.end for a in found[:-1]] == [b.start for b in found[1:]]
    assert found[-1].end == 4
    assert found[-1].certainty > 0.9
    assert recogniser().intervals(frames[19:], 20)[0].emotion == "joy"
    assert abs(next(i.start for i in found if i.emotion == "fear") - 2.5) <= 0.15
    assert recogniser().intervals(frames[:1], 20)[0].emotion == "neutral"


@pytest.mark.parametrize(
    "units", [{6: 0.5, 12: 0.7, 25: 0.8}, {6: 0.8, 12: 0.9, 25: 1.0, 26: 0.6}, {10: 0.7, 12: 0.6, 25: 0.8}]
)
def test_names_call_a_smile_that_shows_the_teeth_joy(units: dict[int, float]) -> None:
    row = au_row({(unit, "BOTH"): value for unit, value in units.items()})
    frames = to_fap(AUFrames(np.zeros(1), row[None])).values
    assert recogniser().names(frames) == ["joy"]


def test_intervals_leave_out_when_no_face_is_seen() -> None:
    frames, there = np.zeros((50, 68)), np.repeat([True, False, True], [10, 20, 20])
    found = recogniser().intervals(frames, 10, visible=there)
    assert [(part.start, part.end, part.emotion) for part in found] == [
        (0.0, 1.0, "neutral"),
        (3.0, 5.0, "neutral"),
    ]


def test_names_reject_a_face_that_shows_none_of_them() -> None:
    brows, mouth = (archetypes()[name][0].frame() for name in ("anger", "surprise"))
    mixed = np.concatenate([2 * mouth[:18], -brows[18:40], mouth[40:]])
    ((name, certainty),) = recogniser().certainties(mixed[None])
    assert name is None
    assert certainty < 0.5


@pytest.mark.parametrize("profiles", ["own", "published"])
@pytest.mark.parametrize("name", ["ada", "ben"])
def test_recogniser_names_archetypes_from_the_15_features(profiles: str, name: str) -> None:
    """The ranges in feature space are those of ada's face; ben is another."""
    chance, face = np.random.default_rng(3), load_face(name)
    every = [profile for numbered in archetypes(profiles).values() for profile in numbered.values()]
    known = Recogniser([measurable_profile(profile, load_face("ada")) for profile in every])
    drawn = np.stack([profile.draw(chance) for profile in every for _ in range(4)])
    got = known.names(*features_from_mesh(face, deform(face, drawn)))
    wanted = [emotion_of(profile.name) for profile in every for _ in range(4)]
    assert np.mean([a == b for a, b in zip(got, wanted, strict=True)]) > 0.95


@pytest.mark.parametrize("profiles", ["own", "published", "raw"])
def test_recogniser_recognises_the_neutral_face(profiles: str) -> None:
    assert name_of(recogniser(profiles), np.zeros(68)) == "neutral"


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
        assert name_of(known, weaker.frame()) == name, weaker
        right = sum(got == name for got in known.names(noisy(weaker, 3)))
        assert right >= 0.9 * DRAWS, name


@pytest.mark.parametrize("name", [place.name for place in ring("paul").values() if place.kind == "advanced"])
def test_recogniser_names_a_blend_of_two_archetypes(name: str) -> None:
    assert recogniser().certainties(emotion(name).frame()[None]) == [(name, 1.0)]


def test_recogniser_recognises_a_word_as_its_archetype() -> None:
    known = recogniser()
    wanted = {"sad": "sadness", "afraid": "fear", "angry": "anger", "disgusted": "disgust", "happy": "joy"}
    assert {word: name_of(known, emotion(word).frame()) for word in wanted} == wanted
    assert name_of(known, emotion("terrified").frame()) == "fear"


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
