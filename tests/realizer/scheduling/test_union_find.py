"""Tests of the union-find structure with offsets."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.scheduling.union_find import UnionFind

NODES = 8
nodes = st.integers(0, NODES - 1)


def test_tie_keeps_distances_and_measures_misfits() -> None:
    ties = UnionFind(5)
    assert ties.tie(4, 3, 1.0) == 0
    assert ties.tie(3, 1, 2.0) == 0
    assert ties.tie(2, 4, -5.0) == 0
    assert [ties.find(k) for k in range(5)] == [0, 1, 1, 1, 1]
    assert [ties.shift[k] for k in (1, 2, 3, 4)] == [0, -2, 2, 3]
    assert ties.tie(4, 1, 3.0) == 0
    assert ties.tie(4, 1, 3.5) == pytest.approx(0.5)
    assert ties.tie(0, 2, 0.0) == 0
    assert {ties.find(k) for k in range(5)} == {0}
    assert ties.shift[4] == pytest.approx(5)


@given(st.lists(st.tuples(nodes, nodes), max_size=20), st.lists(st.integers(-9, 9), min_size=8, max_size=8))
def test_tie_finds_no_misfit_between_true_distances(pairs: list[tuple[int, int]], time: list[int]) -> None:
    ties = UnionFind(NODES)
    for u, v in pairs:
        assert ties.tie(u, v, float(time[u] - time[v])) == 0
    for k in range(NODES):
        assert time[k] - time[ties.find(k)] == ties.shift[k]
