"""Reduction of rows by group."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.group_reduce import GroupReduction


@pytest.mark.parametrize("by", [np.add, np.maximum])
@given(st.lists(st.integers(0, 9), max_size=30).map(sorted))
def test_group_reduction_is_that_of_each_group_alone(by: np.ufunc, group: list[int]) -> None:
    rows = np.random.default_rng(len(group)).random((len(group), 3)).astype(np.float32)
    rounds = GroupReduction.of(np.array(group, int))
    found = rounds.reduced(rows[rounds.order], by)
    assert sorted(rounds.groups.tolist()) == sorted(set(group))
    for number, row in zip(rounds.groups.tolist(), found, strict=True):
        alone = by.reduce(rows[[k for k, other in enumerate(group) if other == number]], axis=0)
        np.testing.assert_allclose(row, alone, rtol=1e-6)


def test_group_reduction_of_no_rows_is_empty() -> None:
    assert GroupReduction.of(np.zeros(0, int)).reduced(np.zeros((0, 4), np.float32), np.add).shape == (0, 4)
