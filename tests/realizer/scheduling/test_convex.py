"""Tests of the convex solver against another one."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from realizer.scheduling.convex import Quadratic, feasible_start, optimum
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
def test_optimum_costs_no_more_than_what_another_solver_finds(quadratic: Quadratic) -> None:
    def cost(x: np.ndarray) -> float:
        strain = x[quadratic.j] - x[quadratic.i] - quadratic.wanted
        return float(np.sum(quadratic.stiffness * strain * strain))

    def room(x: np.ndarray) -> np.ndarray:
        return x[quadratic.v] - x[quadratic.u] - quadratic.w

    level, cycle = feasible_start(quadratic, np.zeros(NODES))
    assert cycle is None
    found = optimum(quadratic, level)
    assert found[0] == 0.0
    assert (room(found) >= -1e-9).all()
    bounds = {"type": "ineq", "fun": lambda rest: room(np.append(0.0, rest))} if len(quadratic.w) else ()
    other = minimize(lambda rest: cost(np.append(0.0, rest)), level[1:], constraints=bounds, tol=1e-9)
    assert cost(found) <= other.fun + 1e-6


def test_feasible_start_finds_what_cannot_hold_together() -> None:
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
    _, cycle = feasible_start(impossible, np.zeros(NODES))
    assert sorted(cycle or ()) == [0, 1]


def test_optimum_without_springs_satisfies_inequalities() -> None:
    none, nothing = np.zeros(0, np.intp), np.zeros(0)
    u, v, w = np.array([0, 1]), np.array([1, 2]), np.array([1.0, 0.5])
    rigid = Quadratic(3, none, none, nothing, nothing, u, v, w, np.arange(3))
    level, _ = feasible_start(rigid, np.zeros(3))
    found = optimum(rigid, level)
    assert (found[v] - found[u] >= w - 1e-9).all()
