"""Laws of the solver on random problems, and a comparison with solvers of SciPy."""

import numpy as np
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog, minimize

from realizer.core.array_types import Float64
from realizer.scheduling.problem import Part, Problem, Relation
from realizer.scheduling.solve import Solution, solve
from tests.example_counts import examples
from tests.realizer.scheduling.recipes import (
    MOST_BODIES,
    Body,
    Recipe,
    Spot,
    built,
    check_kept,
    cost_of,
    linear,
    point,
    possible,
    slope_of,
    spans,
    spots,
    tenths,
    wild,
)

anything = possible() | wild


def solved(recipe: Recipe, order: list[int] | None = None, **more: float) -> Float64:
    found = solve(built(recipe, order, **more))
    assert isinstance(found, Solution)
    return found.time


def by_scipy(problem: Problem) -> Float64 | None:
    """Return the solution of SLSQP for the gaps, moved to the earliest times by a linear program."""
    a, b, c, d = linear(problem)
    n = len(problem.owner)
    # Start far from all inequalities and corners, from which SLSQP may not converge.
    room = np.hstack([-c, np.ones((len(c), 1))])
    equal = np.hstack([a, np.zeros((len(a), 1))])
    aims = np.random.default_rng(n).normal(size=(3, n)) * 0.01
    corners = [
        linprog([*aim, -1.0], A_ub=room, b_ub=-d, A_eq=equal, b_eq=b, bounds=[(-40, 40)] * n + [(0, 0.1)])
        for aim in aims
    ]
    if any(corner.status != 0 for corner in corners):
        return None
    middle = np.mean([corner.x[:n] for corner in corners], axis=0)
    springs = list(spans(problem))
    if springs:
        # SLSQP has problems with redundant equalities, so it searches the space that they leave free.
        free = null_space(a)
        moving = np.abs(c @ free).max(axis=1, initial=0.0) > 1e-9
        left, sides = (d - c @ middle)[moving], (c @ free)[moving]
        found = minimize(
            lambda z: cost_of(problem, middle + free @ z),
            np.zeros(free.shape[1]),
            jac=lambda z: free.T @ slope_of(problem, middle + free @ z),
            method="SLSQP",
            constraints=[{"type": "ineq", "fun": lambda z: sides @ z - left, "jac": lambda z: sides}],
            options={"ftol": 1e-13, "maxiter": 500},
        )
        best = middle + free @ found.x
    else:
        best = middle
    keep = np.zeros((len(springs), n))
    for k, s in enumerate(springs):
        keep[k, s.point], keep[k, s.point + 1] = -1, 1
    slack = 1e-6  # the error of SLSQP
    early = linprog(
        np.ones(n),
        A_ub=np.vstack([-c, keep, -keep]),
        b_ub=np.concatenate([-d + slack, keep @ best + slack, -(keep @ best) + slack]),
        A_eq=a,
        b_eq=b,
        bounds=(None, None),
    )
    return early.x if early.status == 0 else None


@examples(1.5)
@given(possible())
def test_solve_agrees_with_a_slow_general_solver(recipe: Recipe) -> None:
    problem = built(recipe)
    found, reference = solve(problem), by_scipy(problem)
    assert isinstance(found, Solution)
    assume(reference is not None)
    assert found.cost <= cost_of(problem, reference) + 1e-4
    # It sometimes stops early; its times only count if its cost is as low.
    assume(cost_of(problem, reference) <= found.cost + 1e-4)
    np.testing.assert_allclose(found.time, reference, atol=3e-3)


@examples(2)
@given(wild)
def test_solve_finds_a_conflict_iff_a_linear_program_is_infeasible(recipe: Recipe) -> None:
    # No least gaps: a stated length takes precedence over them, which a linear program does not know.
    recipe = recipe._replace(bodies=[body._replace(least=0.0) for body in recipe.bodies])
    problem = built(recipe)
    a, b, c, d = linear(problem)
    there_are = linprog(np.zeros(len(problem.owner)), A_ub=-c, b_ub=-d, A_eq=a, b_eq=b, bounds=(None, None))
    assert isinstance(solve(problem), Solution) == (there_are.status == 0)


@examples(3)
@given(anything, st.sampled_from([0.0, 0.5]))
def test_solve_keeps_everything_exactly(recipe: Recipe, earliest: float) -> None:
    problem = built(recipe, earliest=earliest)
    found = solve(problem)
    if isinstance(found, Solution):
        check_kept(problem, found.time)
        assert abs(found.cost - cost_of(problem, found.time)) < 1e-9
    else:
        assert found, "a problem without a solution has at least one clash"


# A circle of orders without slack, and two behaviours that an order joins to a held one.
CLOSED = Recipe(
    [
        Body([0.5, 2.0], 0.0, 1.0, False, None),
        Body([0.5, 0.1, 0.3, 1.0], 0.2, 100.0, False, None),
        Body([0.3, 0.5, 0.5], 0.0, 4.0, False, None),
    ],
    [((1, 4), (0, 1), 0.0), ((2, 2), (1, 1), 0.1)],
    [((0, 0), (1, 2), 0.1), ((2, 2), (2, 0), 0.0)],
    [],
)
# A stated length of 0 that rounding makes slightly negative.
ROUNDED = Recipe(
    [
        Body([0.1], 0.0, 1.0, False, None),
        Body([0.2], 0.0, 1.0, True, None),
        Body([0.1], 0.05, 1.0, False, None),
    ],
    [((1, 1), (2, 0), 1.0), ((1, 0), (0, 0), 0.1), ((2, 1), (1, 0), -0.8)],
    [],
    [],
)
JOINED = Recipe(
    [
        Body([0.1, 1.0, 0.3], 0.0, 100.0, False, None),
        Body([0.1, 1.0, 2.0], 0.0, 1.0, False, None),
        Body([1.0], 0.0, 4.0, False, None),
    ],
    [((2, 1), (0, 1), -1.0)],
    [((1, 2), (2, 0), -1.0)],
    [((0, 1), 2.0)],
)


def check_any_order(recipe: Recipe, everyone: list[int]) -> None:
    order = [b for b in everyone if b < len(recipe.bodies)]
    one, other = built(recipe), built(recipe, order)
    found, again = solve(one), solve(other)
    assert isinstance(found, Solution) == isinstance(again, Solution)
    if isinstance(found, Solution) and isinstance(again, Solution):
        for k, b in enumerate(order):
            size = len(one.timings[b].points)
            here, there = one.first[b], other.first[k]
            np.testing.assert_allclose(
                again.time[there : there + size], found.time[here : here + size], atol=1e-6, rtol=0
            )


@examples(3)
@given(anything, st.permutations(range(MOST_BODIES)))
@example(CLOSED, [2, 0, 1, 3, 4, 5])
@example(JOINED, [2, 1, 0, 3, 4, 5])
@example(ROUNDED, [0, 1, 2, 3, 4, 5])
def test_solve_does_not_depend_on_document_order(recipe: Recipe, everyone: list[int]) -> None:
    check_any_order(recipe, everyone)


@examples(1.5)
@given(possible(stiffness=(1e-3, 1.0, 1e3)), st.permutations(range(MOST_BODIES)))
def test_solve_does_not_depend_on_order_with_very_different_stiffness(
    recipe: Recipe, everyone: list[int]
) -> None:
    check_any_order(recipe, everyone)


@examples(1.5)
@given(possible(), st.sampled_from([0.0, 0.5]), st.integers(-50, 1000).map(lambda k: k / 10))
def test_solve_moves_everything_with_fixed_times(recipe: Recipe, earliest: float, late: float) -> None:
    problem = built(recipe, earliest=earliest)
    if not isinstance(solve(problem), Solution):
        return
    time = solved(recipe, earliest=earliest)
    moved = solved(recipe, earliest=earliest, late=late)
    np.testing.assert_allclose(moved[1:], time[1:] + late, atol=1e-6, rtol=0)


@examples(2)
@given(anything)
def test_solve_has_no_cheaper_feasible_neighbour(recipe: Recipe) -> None:
    problem = built(recipe)
    found = solve(problem)
    if not isinstance(found, Solution):
        return
    # The steepest feasible descent: a linear program over a small box around the solution.
    a, b, c, d = linear(problem)
    step = 1e-3
    room = np.minimum(d - c @ found.time, 0.0)
    slope = slope_of(problem, found.time)
    nudge = linprog(slope, A_ub=-c, b_ub=-room, A_eq=a, b_eq=np.zeros(len(b)), bounds=(-step, step))
    assert nudge.status == 0
    assert nudge.fun > -1e-5 * step


@examples(2)
@given(anything)
def test_solve_starts_free_behaviours_as_early_as_possible(recipe: Recipe) -> None:
    problem = built(recipe)
    found = solve(problem)
    if not isinstance(found, Solution):
        return
    a, b, c, d = linear(problem)
    n = len(problem.owner)
    springs = list(spans(problem))
    keep = np.zeros((len(springs), n))
    for k, s in enumerate(springs):
        keep[k, s.point], keep[k, s.point + 1] = -1, 1
    sooner = linprog(
        np.ones(n),
        A_ub=-c,
        b_ub=-np.minimum(d - c @ found.time, 0.0),
        A_eq=np.vstack([a, keep]),
        b_eq=np.zeros(len(b) + len(springs)),
        bounds=(-1, 1),
    )
    assert sooner.status == 0
    assert sooner.fun > -1e-6


@given(st.lists(st.floats(0.01, 5), min_size=1, max_size=8), st.floats(0.1, 10), st.floats(0, 3))
def test_solve_gives_a_lone_behaviour_its_preferred_gaps(
    gaps: list[float], stiffness: float, earliest: float
) -> None:
    time = solved(Recipe([Body(gaps, 0.01, stiffness, False, None)], [], [], []), earliest=earliest)
    assert time[1] == earliest
    np.testing.assert_allclose(np.diff(time[1:]), gaps, atol=1e-12)


@examples(1.5)
@given(anything, spots, spots, tenths)
@example(Recipe([Body([1.0], 0.0, 1.0, False, None)], [], [], []), (0, 0), (0, 1), 0.0)
def test_solve_ignores_a_constraint_that_already_holds(recipe: Recipe, u: Spot, v: Spot, less: float) -> None:
    problem = built(recipe)
    found = solve(problem)
    if not isinstance(found, Solution):
        return
    p, q = point(problem, u), point(problem, v)
    part = Part("block", "", is_constraint=True)
    apart = float(found.time[q] - found.time[p])
    for equal, seconds in ((True, apart), (False, apart - less)):
        more = built(recipe)
        if equal:
            more.equalities.append(Relation(q, p, seconds, part, ("", "=", "")))
        else:
            more.orders.append(Relation(p, q, seconds, part, ("", "not before", "")))
        again = solve(more)
        assert isinstance(again, Solution)
        np.testing.assert_allclose(again.time, found.time, atol=1e-6, rtol=0)


@examples(1.5)
@given(wild)
def test_solve_is_feasible_after_dropping_behaviours(recipe: Recipe) -> None:
    problem = built(recipe)
    size = len(problem.behaviours)
    for _ in range(size + 1):
        found = solve(problem)
        if isinstance(found, Solution):
            check_kept(problem, found.time)
            return
        named = [part for clash in found for part in clash.named]
        assert named, "a clash names behaviours that could go"
        problem = problem.without(named[-1:])
    raise AssertionError("dropping every behaviour left a clash")
