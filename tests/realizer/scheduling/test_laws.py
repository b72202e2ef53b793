"""Laws of the solver on random problems, and its answers beside those of SciPy's slow general ones."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.optimize import linprog, minimize

from realizer.arrays import Float64
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation
from realizer.scheduling.solve import Solution, solve
from realizer.scheduling.timing import Timing

# A recipe is a problem as plain numbers, so that it can be built in any order and shrinks well: behaviours
# [(preferred gaps, least, stiffness, rigid)], equalities and orders [((b, point), (b, point), seconds)], pins
# [((b, point), seconds)]. Points are counted modulo what the behaviour has.
Spot = tuple[int, int]
Tie = tuple[Spot, Spot, float]
Recipe = tuple[list[tuple[list[float], float, float, bool]], list[Tie], list[Tie], list[tuple[Spot, float]]]

tenths = st.integers(0, 20).map(lambda k: k / 10)
offsets = st.integers(-10, 10).map(lambda k: k / 10)
behaviours = st.lists(
    st.tuples(
        st.lists(st.integers(1, 20).map(lambda k: k / 10), min_size=1, max_size=3),
        st.sampled_from([0.0, 0.05, 0.1]),
        st.sampled_from([0.5, 1.0, 4.0]),
        st.booleans(),
    ),
    min_size=1,
    max_size=6,
)
spots = st.tuples(st.integers(0, 5), st.integers(0, 3))
ties = st.tuples(spots, spots, offsets)
recipes = st.tuples(
    behaviours,
    st.lists(ties, max_size=5),
    st.lists(ties, max_size=5),
    st.lists(st.tuples(spots, tenths), max_size=2),
)


def point(problem: Problem, spot: Spot) -> int:
    b = spot[0] % len(problem.first)
    return problem.first[b] + spot[1] % len(problem.timings[b].points)


def built(recipe: Recipe, order: list[int] | None = None, *, earliest: float = 0.0) -> Problem:
    """The problem of a recipe; its behaviours in another order, its relations backwards then."""
    bodies, equalities, orders, pins = recipe
    places = list(range(len(bodies))) if order is None else order
    problem = Problem()
    for b in places:
        gaps, least, stiffness, rigid = bodies[b]
        points = tuple(f"p{i}" for i in range(len(gaps) + 1))
        timing = Timing(
            points,
            np.array(gaps),
            np.full(len(gaps), least),
            stiffness * np.arange(1.0, len(gaps) + 1.0),
            rigid,
        )
        problem.add(Part(f"block:{b}", f"b{b}", order=b), timing, earliest)
    number = {b: k for k, b in enumerate(places)}

    def at(spot: Spot) -> int:
        return point(problem, (number[spot[0] % len(bodies)], spot[1]))

    part = Part("block", "", is_constraint=True, required=True)
    for u, v, seconds in equalities:
        problem.equalities.append(Relation(at(u), at(v), seconds, part, ("", "=", "")))
    for u, v, seconds in orders:
        problem.orders.append(Relation(at(u), at(v), seconds, part, ("", "not before", "")))
    for u, seconds in pins:
        problem.equalities.append(Relation(at(u), ORIGIN, seconds, part, ("", "=", "")))
    if order is not None:
        problem.equalities.reverse()
        problem.orders.reverse()
    return problem


def gaps_of(problem: Problem) -> list[tuple[int, float, float, float]]:
    """(point, preferred, least, stiffness) of every gap of a behaviour that is not rigid."""
    return [
        (first + i, t.preferred[i], t.least[i], t.stiffness[i])
        for first, t in zip(problem.first, problem.timings, strict=True)
        if not t.rigid
        for i in range(len(t.preferred))
    ]


def cost_of(problem: Problem, time: Float64) -> float:
    return float(sum(a * (time[p + 1] - time[p] - d) ** 2 for p, d, _, a in gaps_of(problem)))


def check_kept(problem: Problem, time: Float64, within: float = 1e-6) -> None:
    """Everything that must hold, holds."""
    for u, v, seconds, _, _ in problem.equalities:
        assert abs(time[u] - time[v] - seconds) <= within
    for u, v, seconds, _, _ in problem.orders:
        assert time[v] - time[u] >= seconds - within
    for p, _, _, _ in gaps_of(problem):
        assert time[p + 1] >= time[p]
    for first, earliest in zip(problem.first, problem.earliest, strict=True):
        assert time[first] >= earliest


def linear(problem: Problem) -> tuple[Float64, Float64, Float64, Float64]:
    """(A, b, C, d): A t = b and C t >= d for the times of all points, written down plainly."""
    n = len(problem.owner)

    def row(plus: int, minus: int) -> Float64:
        line = np.zeros(n)
        line[plus] += 1
        line[minus] -= 1
        return line

    start = np.zeros(n)
    start[ORIGIN] = 1
    equal = [(start, 0.0), *((row(u, v), s) for u, v, s, _, _ in problem.equalities)]
    more = [(row(v, u), s) for u, v, s, _, _ in problem.orders]
    more += [(row(p + 1, p), least) for p, _, least, _ in gaps_of(problem)]
    more += [(row(first, ORIGIN), e) for first, e in zip(problem.first, problem.earliest, strict=True)]
    matrix, right = zip(*equal, strict=True)
    lower, bound = zip(*more, strict=True)
    return np.array(matrix), np.array(right), np.array(lower), np.array(bound)


def by_scipy(problem: Problem) -> Float64 | None:
    """The reference: SLSQP for the gaps, then a linear program moves everything to its earliest place."""
    a, b, c, d = linear(problem)
    n = len(problem.owner)
    # From a corner SLSQP may not find its way, so it starts from the middle of several.
    aims = np.vstack([np.eye(n), -np.eye(n)])
    corners = [linprog(aim, A_ub=-c, b_ub=-d, A_eq=a, b_eq=b, bounds=(-20, 20)) for aim in aims]
    if any(corner.status != 0 for corner in corners):
        return None
    middle = np.mean([corner.x for corner in corners], axis=0)
    gaps = gaps_of(problem)
    if gaps:
        p = np.array([g[0] for g in gaps])
        wanted, stiffness = np.array([g[1] for g in gaps]), np.array([g[3] for g in gaps])

        def cost(t: Float64) -> float:
            return float(np.sum(stiffness * (t[p + 1] - t[p] - wanted) ** 2))

        def slope(t: Float64) -> Float64:
            force = 2 * stiffness * (t[p + 1] - t[p] - wanted)
            return np.bincount(p + 1, force, n) - np.bincount(p, force, n)

        # SLSQP stumbles over what others imply; so it moves within what the equalities leave free.
        free = null_space(a)
        moving = np.abs(c @ free).max(axis=1, initial=0.0) > 1e-9
        room, sides = (d - c @ middle)[moving], (c @ free)[moving]
        found = minimize(
            lambda z: cost(middle + free @ z),
            np.zeros(free.shape[1]),
            jac=lambda z: free.T @ slope(middle + free @ z),
            method="SLSQP",
            constraints=[{"type": "ineq", "fun": lambda z: sides @ z - room, "jac": lambda z: sides}],
            options={"ftol": 1e-13, "maxiter": 500},
        )
        best = middle + free @ found.x
    else:
        best = middle
    keep = np.zeros((len(gaps), n))
    for k, (q, *_) in enumerate(gaps):
        keep[k, q], keep[k, q + 1] = -1, 1
    slack = 1e-6  # what SLSQP leaves
    early = linprog(
        np.ones(n),
        A_ub=np.vstack([-c, keep, -keep]),
        b_ub=np.concatenate([-d + slack, keep @ best + slack, -(keep @ best) + slack]),
        A_eq=a,
        b_eq=b,
        bounds=(None, None),
    )
    return early.x if early.status == 0 else None


@settings(max_examples=150, deadline=None)
@given(recipes)
def test_times_are_those_of_a_slow_general_solver(recipe: Recipe) -> None:
    # No least gaps: a length that the document states wins over them, which the reference does not know.
    bodies, *rest = recipe
    recipe = ([(gaps, 0.0, stiffness, rigid) for gaps, _, stiffness, rigid in bodies], *rest)
    problem = built(recipe)
    found, reference = solve(problem), by_scipy(problem)
    if not isinstance(found, Solution):
        assert reference is None
        return
    assume(reference is not None)
    assert found.cost <= cost_of(problem, reference) + 1e-4
    # It gives up early now and then; what it says of the times counts where it got as far.
    assume(cost_of(problem, reference) <= found.cost + 1e-4)
    np.testing.assert_allclose(found.time, reference, atol=2e-3)


@settings(max_examples=300, deadline=None)
@given(recipes, st.sampled_from([0.0, 0.5]))
def test_everything_is_kept_exactly(recipe: Recipe, earliest: float) -> None:
    problem = built(recipe, earliest=earliest)
    found = solve(problem)
    if isinstance(found, Solution):
        check_kept(problem, found.time)
        assert abs(found.cost - cost_of(problem, found.time)) < 1e-9
    else:
        assert found, "a problem without a solution has at least one clash"


# A circle of orders that leaves no room at all, and two behaviours that an order to a held one joins.
CLOSED: Recipe = (
    [
        ([0.5, 2.0], 0.0, 1.0, False),
        ([0.5, 0.1, 0.3, 1.0], 0.2, 100.0, False),
        ([0.3, 0.5, 0.5], 0.0, 4.0, False),
    ],
    [((1, 4), (0, 1), 0.0), ((2, 2), (1, 1), 0.1)],
    [((0, 0), (1, 2), 0.1), ((2, 2), (2, 0), 0.0)],
    [],
)
# A length of nothing that is stated, by way of sums that rounding makes a little less than nothing.
ROUNDED: Recipe = (
    [([0.1], 0.0, 1.0, False), ([0.2], 0.0, 1.0, True), ([0.1], 0.05, 1.0, False)],
    [((1, 1), (2, 0), 1.0), ((1, 0), (0, 0), 0.1), ((2, 1), (1, 0), -0.8)],
    [],
    [],
)
JOINED: Recipe = (
    [([0.1, 1.0, 0.3], 0.0, 100.0, False), ([0.1, 1.0, 2.0], 0.0, 1.0, False), ([1.0], 0.0, 4.0, False)],
    [((2, 1), (0, 1), -1.0)],
    [((1, 2), (2, 0), -1.0)],
    [((0, 1), 2.0)],
)


@settings(max_examples=300, deadline=None)
@given(recipes, st.permutations(range(6)))
@example(CLOSED, [2, 0, 1, 3, 4, 5])
@example(JOINED, [2, 1, 0, 3, 4, 5])
@example(ROUNDED, [0, 1, 2, 3, 4, 5])
def test_document_order_does_not_matter(recipe: Recipe, everyone: list[int]) -> None:
    order = [b for b in everyone if b < len(recipe[0])]
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


@settings(max_examples=150, deadline=None)
@given(recipes)
def test_no_feasible_nudge_is_cheaper(recipe: Recipe) -> None:
    problem = built(recipe)
    found = solve(problem)
    if not isinstance(found, Solution) or not gaps_of(problem):
        return
    # Downhill as far as the constraints let it go: a linear program over a small box around the solution.
    a, b, c, d = linear(problem)
    time, n, step = found.time, len(problem.owner), 1e-3
    slope = np.zeros(n)
    for p, wanted, _, stiffness in gaps_of(problem):
        force = 2 * stiffness * (time[p + 1] - time[p] - wanted)
        slope[p + 1] += force
        slope[p] -= force
    room = np.minimum(d - c @ time, 0.0)
    nudge = linprog(slope, A_ub=-c, b_ub=-room, A_eq=a, b_eq=np.zeros(len(b)), bounds=(-step, step))
    assert nudge.status == 0
    assert nudge.fun > -1e-5 * step


@settings(max_examples=150, deadline=None)
@given(recipes)
def test_nothing_free_could_start_sooner(recipe: Recipe) -> None:
    problem = built(recipe)
    found = solve(problem)
    if not isinstance(found, Solution):
        return
    a, b, c, d = linear(problem)
    n = len(problem.owner)
    gaps = gaps_of(problem)
    keep = np.zeros((len(gaps), n))
    for k, (p, *_) in enumerate(gaps):
        keep[k, p], keep[k, p + 1] = -1, 1
    room = np.minimum(d - c @ found.time, 0.0)
    sooner = linprog(
        np.ones(n),
        A_ub=-c,
        b_ub=-room,
        A_eq=np.vstack([a, keep]),
        b_eq=np.zeros(len(b) + len(gaps)),
        bounds=(-1, 1),
    )
    assert sooner.status == 0
    assert sooner.fun > -1e-6


@given(st.lists(st.floats(0.01, 5), min_size=1, max_size=8), st.floats(0.1, 10), st.floats(0, 3))
def test_a_lone_behaviour_gets_its_preferred_gaps(
    gaps: list[float], stiffness: float, earliest: float
) -> None:
    found = solve(built(([(gaps, 0.01, stiffness, False)], [], [], []), earliest=earliest))
    assert isinstance(found, Solution)
    assert found.time[1] == earliest
    np.testing.assert_allclose(np.diff(found.time[1:]), gaps, atol=1e-12)


@settings(max_examples=200, deadline=None)
@given(recipes, spots, spots, tenths)
@example(([([1.0], 0.0, 1.0, False)], [], [], []), (0, 0), (0, 1), 0.0)
def test_a_constraint_that_already_holds_changes_nothing(
    recipe: Recipe, u: Spot, v: Spot, less: float
) -> None:
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


@settings(max_examples=100, deadline=None)
@given(recipes)
def test_what_remains_after_dropping_is_feasible(recipe: Recipe) -> None:
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
