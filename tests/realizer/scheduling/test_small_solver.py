"""Tests of the solver for small problems against the one in arrays."""

import numpy as np
import pytest
from hypothesis import assume, given

from realizer.scheduling import solve as solver
from realizer.scheduling.problem import ORIGIN
from realizer.scheduling.small_solver import solve_small
from tests.example_counts import examples
from tests.realizer.scheduling.recipes import Body, Recipe, built, possible, tenths, wild

FREE = Body([1.0, 1.0], 0.1, 1.0, False, None)


def in_arrays(recipe: Recipe, earliest: float = 0.0) -> solver.Solution:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solver, "FEW", 0)
        found = solver.solve(built(recipe, earliest=earliest))
    assert isinstance(found, solver.Solution)
    return found


@examples(1.5)
@given(possible() | wild, tenths)
def test_solve_small_agrees_with_the_solver_in_arrays(recipe: Recipe, earliest: float) -> None:
    recipe = recipe._replace(orders=[])
    found = solve_small(built(recipe, earliest=earliest))
    assume(found is not None)
    time, cost = found
    other = in_arrays(recipe, earliest)
    np.testing.assert_allclose(time, other.time, rtol=0.0, atol=1e-9)
    problem = built(recipe, earliest=earliest)
    for first, timing in zip(problem.first, problem.timings, strict=True):
        own = time[first : first + len(timing.points)]
        assert own == sorted(own), "in order, whatever rounding did"
    assert cost == pytest.approx(other.cost, abs=1e-9)
    assert time[ORIGIN] == 0.0


def test_solve_small_shares_the_strain_and_starts_at_once() -> None:
    short, long = FREE, Body([1.0, 2.0], 0.1, 1.0, False, None)
    found = solve_small(built(Recipe([short, long], [((0, 0), (1, 0), 0.0), ((0, 2), (1, 2), 0.0)], [], [])))
    assert found is not None
    assert found[0][3] == pytest.approx(found[0][6])
    assert found[0][1] == found[0][4] == 0.0
    assert 2.0 < found[0][3] < 3.0


@pytest.mark.parametrize(
    "recipe",
    [
        Recipe([FREE], [], [((0, 0), (0, 1), 0.5)], []),
        Recipe([FREE], [], [], [((0, 0), 1.0), ((0, 0), 1.5)]),
        Recipe([FREE], [], [], [((0, 0), 1.0), ((0, 2), 1.15)]),
        Recipe([FREE._replace(most=1.2)], [], [], [((0, 0), 1.0), ((0, 2), 4.0)]),
        Recipe([FREE], [], [], [((0, 0), -1.0)]),
    ],
    ids=["an order", "a clash", "least gaps", "greatest gaps", "too soon"],
)
def test_solve_small_gives_up_in_harder_cases(recipe: Recipe) -> None:
    assert solve_small(built(recipe)) is None
