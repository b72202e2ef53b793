"""Tests of the active-set method against the interior point method."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from realizer.scheduling.convex import Quadratic, active_set, feasible_start, optimum
from tests.example_counts import examples

NODES = 7
nodes = st.integers(0, NODES - 1)
number = st.integers(0, 20)


@st.composite
def quadratics(draw: st.DrawFn) -> Quadratic:
    """Draw a chain of springs with more across, and inequalities that a hidden x satisfies."""
    hidden = [0, *draw(st.lists(number, min_size=NODES - 1, max_size=NODES - 1))]
    pairs = [(k, k + 1) for k in range(NODES - 1)]
    pairs += draw(st.lists(st.tuples(nodes, nodes).filter(lambda p: p[0] != p[1]), max_size=4))
    bounds = draw(st.lists(st.tuples(nodes, nodes, st.sampled_from([0, 0, 1, 9])), max_size=10))
    i, j = np.array(pairs).T
    wanted = np.array([draw(number) for _ in pairs]) / 10
    stiffness = np.array([draw(st.sampled_from([0.5, 1.0, 100.0])) for _ in pairs])
    u, v, slack = np.array(bounds, np.intp).reshape(-1, 3).T
    w = (np.array(hidden)[v] - np.array(hidden)[u] - slack) / 10
    return Quadratic(NODES, i, j, wanted, stiffness, u, v, w, np.zeros(NODES, np.intp))


@examples(1.5)
@given(quadratics())
def test_active_set_finds_the_optimum_of_the_interior_point_method(quadratic: Quadratic) -> None:
    start = np.zeros(NODES)
    level, cycle = feasible_start(quadratic, start)
    assert cycle is None
    surely = optimum(quadratic, level)
    quickly = active_set(quadratic, start)
    room = surely[quadratic.v] - surely[quadratic.u] - quadratic.w
    assert (room >= -1e-6).all()
    if quickly is not None:
        np.testing.assert_allclose(quickly, surely, atol=1e-6)


def test_active_set_of_an_infeasible_problem_is_none() -> None:
    springs = np.arange(NODES - 1)
    one = np.ones(NODES - 1)
    impossible = Quadratic(
        NODES,
        springs,
        springs + 1,
        one,
        one,
        np.array([0, 3]),
        np.array([3, 0]),
        np.array([1.0, 1.0]),
        np.zeros(NODES, np.intp),
    )
    assert active_set(impossible, np.zeros(NODES)) is None
    _, cycle = feasible_start(impossible, np.zeros(NODES))
    assert sorted(cycle or ()) == [0, 1]
