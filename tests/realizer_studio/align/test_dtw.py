"""The cheapest path through states with pauses between words."""

import numpy as np
import pytest

from realizer_studio.align.dtw import Observed, States, best_path, distance, quiet, usual

LETTERS = np.eye(5) * 2


def states(word: str) -> States:
    """Return a state for each letter; "_" is an optional pause."""
    pause = np.array([letter == "_" for letter in word])
    rows = np.array([LETTERS[0] if letter == "_" else LETTERS["abcde".index(letter)] for letter in word])
    return States(rows, pause, np.arange(len(word), dtype=float))


def heard(word: str) -> Observed:
    """Return a frame for each letter; "_" is silent."""
    rows = np.array([np.zeros(5) if letter == "_" else LETTERS["abcde".index(letter)] for letter in word])
    loud = np.array([0.0 if letter == "_" else 1.0 for letter in word])
    return Observed(rows, quiet(loud, 0.1), 1.0)


def way(frames: str, said: str, **band) -> str:
    found, _ = best_path(heard(frames), states(said), **band)
    return "".join(said[k] for k in found)


def test_best_path_stretches_states() -> None:
    assert way("__aaabbcddd__", "_abccd_") == "__aaabbcddd__"


def test_best_path_skips_pauses_or_stays_in_them() -> None:
    assert way("_aabb_", "_ab_") == "_aabb_"
    assert way("_aabb_", "_a_b_") == "_aabb_"
    assert way("_aaaaaa____________bbbbbb_", "_a_b_") == "_aaaaaa____________bbbbbb_"


def test_best_path_has_no_pause_inside_a_word() -> None:
    assert set(way("_aaaaaa____________bbbbbb_", "_ab_")[7:19]) <= {"a", "b"}


def test_best_path_in_a_band_is_the_same() -> None:
    frames, said = "__" + "aabbbcdde" * 20 + "__", "_" + "abcde_" * 20
    whole, cost = best_path(heard(frames), states(said))
    banded, cost_banded = best_path(heard(frames), states(said), whole, 6)
    assert (whole == banded).all()
    assert cost_banded == pytest.approx(cost)
    diagonal = np.rint(np.linspace(0, len(said) - 1, len(frames))).astype(np.intp)
    assert (best_path(heard(frames), states(said), diagonal, 40)[0] == whole).all()


def test_best_path_advances_to_the_end() -> None:
    rng = np.random.default_rng(0)
    noise = Observed(rng.normal(size=(80, 5)), quiet(rng.random(80), 0.1), 1.0)
    found, cost = best_path(noise, states("_" + "abcde_" * 9))
    assert (np.diff(found) >= 0).all()
    assert (np.diff(found) <= 3).all()
    assert found[-1] >= 53
    assert np.isfinite(cost).all()


def test_distance_is_the_root_mean_square() -> None:
    assert distance(np.zeros((1, 4)), np.array([[2.0, 0, 0, 0], [1, 1, 1, 1]])).tolist() == [[1.0, 1.0]]
    assert usual(np.zeros((3, 4)), np.ones((5, 4))) == 1.0
