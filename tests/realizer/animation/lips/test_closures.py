"""Lip closures: their durations, and when speech masks the lips."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.closures import BILABIAL, LABIODENTAL, closure_mask, lip_weight
from realizer.animation.lips.dominance import key_times, track_of
from realizer.animation.lips.visemes import coarticulation, sounds
from realizer.core.array_types import Bool, Float64
from realizer.speech.utterance import Phoneme

FRAME = 0.04  # s
PAUSE = ("", 0.5)


def phonemes(*said: tuple[str, float]) -> tuple[Phoneme, ...]:
    """(IPA, seconds) one after another."""
    ends = np.cumsum([length for _, length in said])
    return tuple(
        Phoneme(float(end - length), float(end), ipa) for (ipa, length), end in zip(said, ends, strict=True)
    )


def holds(*said: tuple[str, float]) -> tuple[Float64, Bool, Bool]:
    """Keys; whether the lips are closed, and whether the lower one is bitten."""
    found = phonemes(*said)
    track, times = track_of(found), key_times(found)
    assert track is not None
    return (times, *closure_mask(track, times))


def taken(*said: tuple[str, float]) -> tuple[Float64, Float64]:
    found = phonemes(*said)
    track, times = track_of(found), key_times(found)
    assert track is not None
    return times, lip_weight(track, times)


def longest(times: Float64, mine: Bool) -> float:
    """Return the seconds from the first to the last key of a closure."""
    return float(np.ptp(times[mine])) if mine.any() else 0.0


def test_closure_visemes_are_those_of_p_and_f() -> None:
    assert sounds("p")[0].mix == ((BILABIAL, 1.0),)
    assert sounds("f")[0].mix == ((LABIODENTAL, 1.0),)
    assert coarticulation()["closure"]["visemes"] == [BILABIAL, LABIODENTAL]


@pytest.mark.parametrize("length", [0.02, 0.04, 0.08, 0.15])
@pytest.mark.parametrize(("ipa", "row"), [("p", 0), ("v", 1)])
def test_closure_mask_is_longer_than_a_frame_around_its_sound(ipa: str, row: int, length: float) -> None:
    times, *rows = holds(PAUSE, ("a", 0.1), (ipa, length), ("a", 0.1), PAUSE)
    assert longest(times, rows[row]) > FRAME
    middle = 0.6 + length / 2
    assert times[rows[row]].mean() == pytest.approx(middle, abs=0.01)
    assert not rows[1 - row].any()


def test_closure_mask_of_vowels_is_empty() -> None:
    _, closed, bitten = holds(PAUSE, ("a", 0.1), ("t", 0.1), ("u", 0.1), PAUSE)
    assert not closed.any()
    assert not bitten.any()


@pytest.mark.parametrize("pair", [("m", "f"), ("f", "p"), ("v", "m")])
@given(st.floats(0.02, 0.1), st.floats(0.02, 0.1))
def test_closure_mask_separates_closures_from_bites(pair: tuple[str, str], one: float, other: float) -> None:
    """All closures are shown in order, whatever their lengths, and overlap in one key at most."""
    times, closed, bitten = holds(PAUSE, ("a", 0.1), (pair[0], one), (pair[1], other), ("a", 0.1), PAUSE)
    assert closed.any()
    assert bitten.any()
    assert (closed & bitten).sum() <= 1
    first, second = (closed, bitten) if pair[0] in "pbm" else (bitten, closed)
    assert times[first].mean() < times[second].mean()


def shown(kinds: str, length: float, quiet: str = "") -> tuple[Float64, Bool, Bool]:
    """Return the masks of closures without a sound between them, every millisecond.

    Args:
        quiet: which of the sounds only move the tongue.
    """
    sounds = [("t" if str(k) in quiet else ipa, length) for k, ipa in enumerate(kinds)]
    track = track_of(phonemes(PAUSE, *sounds, PAUSE))
    times = np.arange(0, 1 + len(kinds) * length, 0.001)
    assert track is not None
    return (times, *closure_mask(track, times))


@given(st.text("pf", min_size=2, max_size=5), st.floats(0.03, 0.08))
def test_closure_mask_moves_closures_and_bites_apart(kinds: str, length: float) -> None:
    """The first one begins earlier than without the others if the next is of the other kind; else as then."""
    for first, edge, other, way in ((0, 0, 1, -1), (len(kinds) - 1, -1, -2, 1)):
        quiet = "".join(str(k) for k in range(len(kinds)) if k != first)
        here, alone = (
            times[closed | bitten][edge]
            for times, closed, bitten in (shown(kinds, length), shown(kinds, length, quiet))
        )
        if kinds[edge] != kinds[other]:
            assert way * (here - alone) > 0.002
        else:
            assert here == pytest.approx(alone, abs=1e-6)


@pytest.mark.parametrize("kinds", ["pf", "fp"])
@given(st.floats(0.03, 0.04))
def test_closure_mask_of_a_bite_lasts_longer_beside_a_closure(kinds: str, length: float) -> None:
    _, closed, bitten = shown(kinds, length)
    assert bitten.sum() > closed.sum()


def test_lip_weight_lasts_from_the_first_sound_to_the_last() -> None:
    times, lips = taken(PAUSE, ("a", 0.1), ("t", 0.1), ("a", 0.1), PAUSE)
    assert lips[0] == lips[-1] == 0
    assert (lips[(times > 0.5) & (times < 0.8)] > 0.5).all()
    assert lips.max() == pytest.approx(1)
    assert (lips[times < 0.35] == 0).all()


@pytest.mark.parametrize("ipa", ["p", "f", "m"])
def test_lip_weight_is_1_during_the_first_and_last_closure(ipa: str) -> None:
    times, lips = taken(PAUSE, (ipa, 0.07), ("a", 0.1), (ipa, 0.07), PAUSE)
    inside = (times > 0.5) & (times < 0.74)
    assert lips[inside].min() == pytest.approx(1, abs=1e-6)


@given(st.sampled_from("pfm"), st.floats(0.02, 0.1))
def test_lip_weight_is_1_while_the_first_and_last_closure_are_held(ipa: str, length: float) -> None:
    """However short the sound is, the lips are held closed for a frame around its middle."""
    times, lips = taken(PAUSE, (ipa, length), ("a", 0.1), (ipa, length), PAUSE)
    half = max(coarticulation()["closure"]["hold"], length) / 2
    first, last = 0.5 + length / 2, 0.6 + 1.5 * length
    assert lips[(times > first - half) & (times < last + half)].min() == pytest.approx(1, abs=1e-6)


@given(st.floats(0.25, 1))
def test_lip_weight_begins_and_ends_alike_in_pauses_of_any_length(pause: float) -> None:
    offsets = np.linspace(-0.2, 0.4, 31)

    def about_the_sound(pause: float) -> Float64:
        track = track_of(phonemes(("", pause), ("a", 0.2), ("", pause)))
        assert track is not None
        return lip_weight(track, np.array([0, *(pause + offsets), 2 * pause + 0.2]))[1:-1]

    assert about_the_sound(pause) == pytest.approx(about_the_sound(2.0))


def test_lip_weight_stays_1_in_a_short_pause() -> None:
    pauses = coarticulation()["pauses"]
    length = (pauses["absorbed"] + pauses["released"]) / 2
    times, lips = taken(PAUSE, ("a", 0.5), ("", length), ("a", 0.1), PAUSE)
    assert (lips[(times > 1.0) & (times < 1.0 + length)] == 1).all()


@pytest.mark.parametrize(("length", "free"), [(0.3, False), (0.9, True)])
def test_lip_weight_is_0_in_a_long_pause(length: float, free: bool) -> None:
    times, lips = taken(PAUSE, ("a", 0.1), ("", length), ("a", 0.1), PAUSE)
    inside = (times > 0.6) & (times < 0.6 + length)
    assert (lips[inside].min() == 0) == free


@given(
    st.lists(st.tuples(st.sampled_from(["", "p", "f", "m", "a", "u", "t"]), st.floats(0.01, 0.6)), min_size=1)
)
def test_lip_weight_is_continuous(said: list[tuple[str, float]]) -> None:
    found = phonemes(*said)
    track, times = track_of(found), key_times(found)
    if track is None:
        return
    lips = lip_weight(track, times)
    assert lips.min() >= 0
    assert lips.max() <= 1
    least = coarticulation()["pauses"]["least"]
    inner = np.abs(np.diff(lips) / np.diff(times))
    assert inner.max() <= 1.6 / min(least, np.ptp(times) / 2)
