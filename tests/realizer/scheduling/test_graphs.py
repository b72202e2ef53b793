"""Tests of longest paths and strong components."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from realizer.scheduling.graphs import UnionFind, components, longest_path_levels

NODES = 8
nodes = st.integers(0, NODES - 1)
edge_lists = st.lists(st.tuples(nodes, nodes, st.integers(-5, 3).map(float)), max_size=16)


@given(edge_lists)
def test_components_are_those_of_scipy_and_in_order(edges: list[tuple[int, int, float]]) -> None:
    found = components(NODES, edges)
    matrix = csr_array(
        (np.ones(len(edges)), ([e[0] for e in edges], [e[1] for e in edges])), shape=(NODES, NODES)
    )
    count, labels = connected_components(matrix, directed=True, connection="strong")
    assert len(set(found)) == count
    assert len(set(zip(found, labels.tolist(), strict=True))) == count
    assert all(found[u] <= found[v] for u, v, _ in edges)


@given(edge_lists, st.lists(st.integers(0, 9).map(float), min_size=NODES, max_size=NODES))
def test_longest_path_levels_are_the_least_that_satisfy_every_edge(
    edges: list[tuple[int, int, float]], start: list[float]
) -> None:
    level = list(start)
    cycle = longest_path_levels(level, edges, 0.0)
    if cycle is not None:
        chosen = [edges[k] for k in cycle]
        assert sum(w for _, _, w in chosen) > 0
        ends = [v for _, v, _ in chosen]
        assert [u for u, _, _ in chosen] == [ends[-1], *ends[:-1]]
        return
    rows = np.zeros((len(edges), NODES))
    for k, (u, v, _) in enumerate(edges):
        rows[k, u] += 1
        rows[k, v] -= 1
    weights = [-w for _, _, w in edges]
    least = linprog(
        np.ones(NODES),
        A_ub=rows if edges else None,
        b_ub=weights if edges else None,
        bounds=[(s, None) for s in start],
    )
    np.testing.assert_allclose(level, least.x, atol=1e-9)


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
