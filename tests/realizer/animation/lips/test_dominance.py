"""Dominance functions: greatest in the middle of a sound, and never more than 1 in all."""

import numpy as np
import pytest

from realizer.animation.lips.dominance import Track, dominances, key_times, track_of
from realizer.animation.lips.visemes import ARTICULATORS, SHAPE_COLUMNS, coarticulation
from realizer.speech.utterance import Phoneme


def track(*sounds: tuple[str, float]) -> Track:
    found = track_of(phonemes(*sounds))
    assert found is not None
    return found


def phonemes(*sounds: tuple[str, float]) -> tuple[Phoneme, ...]:
    """(IPA, seconds) one after another."""
    ends = np.cumsum([length for _, length in sounds])
    return tuple(
        Phoneme(float(end - length), float(end), ipa) for (ipa, length), end in zip(sounds, ends, strict=True)
    )


def test_track_of_pauses_is_none() -> None:
    assert track_of(()) is None
    assert track_of(phonemes(("", 0.3), ("", 0.2))) is None


def test_track_joins_pauses_and_sounds() -> None:
    found = track(("", 0.3), ("", 0.2), ("a", 0.1), ("t", 0.1), ("", 0.3))
    assert found.rest.tolist() == [True, False, False, True]
    assert found.end[0] == pytest.approx(0.5)
    assert np.array_equal(found.begin[1:], found.end[:-1])


def test_track_absorbs_short_pauses_between_sounds() -> None:
    short = coarticulation()["pauses"]["absorbed"] - 0.01
    assert not track(("a", 0.1), ("", short), ("a", 0.1)).rest.any()
    assert track(("a", 0.1), ("", short + 0.02), ("a", 0.1)).rest.tolist() == [False, True, False]
    # An absorbed pause is divided between the sounds on either side.
    assert track(("a", 0.1), ("", short), ("a", 0.1)).end[0] == pytest.approx(0.1 + short / 2)


def test_track_divides_a_diphthong_into_two_vowels() -> None:
    found = track(("aɪ", 0.2))
    assert found.vowel.tolist() == [True, True]
    assert found.end[0] == pytest.approx(0.2 * coarticulation()["diphthong"]["first"])


def test_key_times_cover_all_sounds_at_their_rate() -> None:
    times = key_times(phonemes(("a", 0.1), ("t", 0.23)))
    assert times[0] == 0
    assert times[-1] == pytest.approx(0.33)
    assert np.diff(times) == pytest.approx(1 / coarticulation()["rate"], rel=0.05)
    assert len(key_times(phonemes(("a", 0.0)))) >= 2


def test_articulators_have_every_column_of_a_mouth_once() -> None:
    assert [name for members in ARTICULATORS.values() for name in members] == list(SHAPE_COLUMNS)


def test_dominances_add_up_to_a_little_less_than_1() -> None:
    said = phonemes(*[(ipa, 0.09) for ipa in "ˈpatəkifumoʃ"])
    found = track_of(said)
    assert found is not None
    for near, parts, _ in dominances(found, key_times(said)):
        assert near.shape == parts.shape
        assert (parts >= 0).all()
        assert (parts.sum(axis=0) < 1).all()
        assert (parts.sum(axis=0) > 0.6).all()


def test_dominances_are_greatest_in_the_middle_of_a_sound() -> None:
    found = track(("t", 0.1), ("a", 0.1), ("t", 0.1))
    times = np.array([0.1, 0.15, 0.2])
    for near, parts, members in dominances(found, times):
        own = np.where(near == 1, parts, 0).sum(axis=0)
        assert own[1] > own[0], members
        assert own[1] > own[2], members


def test_dominances_of_rounding_start_before_those_of_opening() -> None:
    found = track(("t", 0.1), ("s", 0.1), ("u", 0.1))
    ahead = {
        members: np.where(near == 2, parts, 0).sum()
        for near, parts, members in dominances(found, np.array([0.12]))
    }
    assert ahead[ARTICULATORS["rounding"]] > 2 * ahead[ARTICULATORS["lips"]]


def test_dominances_of_long_sounds_fall_more_slowly() -> None:
    """At the same distance before its core, with nothing beside it."""

    def before(length: float) -> float:
        core = length * (1 - coarticulation()["dominance"]["core"]) / 2
        _, parts, _ = next(iter(dominances(track(("a", length)), np.array([core - 0.2]))))
        return float(parts.sum())

    assert before(0.3) > before(0.1) > before(0.04) > 0
