"""Random numbers by seed, kind and index."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.idle.rng import uniform

# SplitMix64's mixing step in whole numbers of any size.
DRAWN = [3087890715344952, 8001453184021247, 936930144049234]


@given(st.integers(-(2**63), 2**63), st.integers(0, 1000), st.integers(-(2**40), 2**40))
def test_uniform_numbers_are_independent_of_other_indices(seed: int, kind: int, k: int) -> None:
    many = uniform(seed, kind, np.arange(k - 3, k + 4))
    assert uniform(seed, kind, np.array([k]))[0] == many[3]
    assert ((many >= 0.0) & (many < 1.0)).all()


def test_uniform_draws_several_kinds_like_each_alone() -> None:
    k = np.arange(5)
    assert (uniform(7, (3, 1, 2), k) == [uniform(7, kind, k) for kind in (3, 1, 2)]).all()


def test_uniform_is_even_and_uncorrelated_between_kinds() -> None:
    one, other = uniform(7, 1, np.arange(20_000)), uniform(7, 2, np.arange(20_000))
    counts, _ = np.histogram(one, 10, (0.0, 1.0))
    assert np.abs(counts - 2000).max() < 200
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.03


def test_uniform_has_known_values() -> None:
    assert (uniform(0, 1, np.arange(3)) * 2**53).astype(np.int64).tolist() == DRAWN
