"""Tests of conflicts against linear programs: none is too large, and none could be shorter."""

from collections.abc import Iterable

import numpy as np
from hypothesis import given
from scipy.optimize import linprog

from realizer.core.array_types import Float64
from realizer.scheduling.conflict import Conflict, LengthBound, Link, in_words
from realizer.scheduling.minimal_cycles import _simple
from realizer.scheduling.problem import ORIGIN, Problem, Relation
from realizer.scheduling.solve import Solution, solve
from tests.example_counts import examples
from tests.realizer.scheduling.recipes import Recipe, built, lasting, schedule, spans, wild

# (u, v, seconds): time[v] >= time[u] + seconds.
Edge = tuple[int, int, float]


def statements(problem: Problem, clash: Conflict) -> list[list[Edge]]:
    """Return the edges of each statement of a conflict."""
    equal = {id(r) for r in problem.equalities}
    said = [both(r) if id(r) in equal else [(r.u, r.v, r.seconds)] for r in clash.relations]
    for gap in clash.gaps:
        u, v = (place(problem, gap, name) for name in (gap.begin, gap.end))
        said.append([(v, u, -gap.seconds)] if gap.most else [(u, v, gap.seconds)])
    if clash.earliest is not None:
        part, name, seconds = clash.earliest
        first = problem.first[problem.behaviours.index(part)]
        assert problem.name_of(first) == name
        said.append([(ORIGIN, first, seconds)])
    return said


def both(relation: Relation) -> list[Edge]:
    return [
        (relation.v, relation.u, relation.seconds),
        (relation.u, relation.v, -relation.seconds),
    ]


def place(problem: Problem, gap: LengthBound, name: str) -> int:
    b = problem.behaviours.index(gap.part)
    return problem.first[b] + problem.timings[b].points.index(name)


def can_hold(n: int, edges: Iterable[Edge]) -> bool:
    rows, bounds = [], []
    for u, v, seconds in edges:
        row = np.zeros(n)
        row[u] += 1
        row[v] -= 1
        rows.append(row)
        bounds.append(-seconds)
    found = linprog(np.zeros(n), A_ub=rows or None, b_ub=bounds or None, bounds=(None, None))
    return bool(found.status == 0)


def clashes_of(recipe: Recipe) -> tuple[Problem, list[Conflict]]:
    problem = built(recipe)
    found = solve(problem)
    return problem, [] if isinstance(found, Solution) else found


@examples(1.5)
@given(wild)
def test_minimal_cycles_can_hold_without_any_one_statement(recipe: Recipe) -> None:
    problem, clashes = clashes_of(recipe)
    n = len(problem.owner)
    for clash in clashes[:2]:
        said = statements(problem, clash)
        assert len(said) == clash.statements
        assert not can_hold(n, (edge for edges in said for edge in edges)), in_words(clash.clauses)
        for left_out in range(len(said)):
            rest = (edge for k, edges in enumerate(said) if k != left_out for edge in edges)
            assert can_hold(n, rest), f"{in_words(clash.clauses)}; number {left_out} has no part in it"


def ways(problem: Problem) -> Float64:
    """Return (n, n) the greatest gain from row to column by one statement; -inf for none."""
    n = len(problem.owner)
    found = np.full((n, n), -np.inf)
    for s in spans(problem):
        found[s.point, s.point + 1], found[s.point + 1, s.point] = s.least, -s.most
    # The gaps between two points of a behaviour are one statement, but no equality between its points is.
    for first, timing in zip(problem.first, problem.timings, strict=True):
        for steps in range(2, 0 if timing.rigid else len(timing.points)):
            for u in range(first, first + len(timing.points) - steps):
                v = u + steps
                found[u, v] = max(found[u, v], found[u, v - 1] + found[v - 1, v])
                found[v, u] = max(found[v, u], found[v, v - 1] + found[v - 1, u])
    edges = [edge for r in problem.equalities for edge in both(r)]
    edges += [(r.u, r.v, r.seconds) for r in problem.orders]
    edges += [(ORIGIN, u, e) for u, e in zip(problem.first, problem.earliest, strict=True)]
    for u, v, seconds in edges:
        found[u, v] = max(found[u, v], seconds)
    return found


@examples(1.5)
@given(wild)
def test_minimal_cycles_have_the_fewest_statements_at_their_points(recipe: Recipe) -> None:
    # A length that the document states takes precedence over least gaps, so these never conflict.
    recipe = recipe._replace(bodies=[body._replace(least=0.0) for body in recipe.bodies])
    problem, clashes = clashes_of(recipe)
    one = ways(problem)
    for clash in clashes:
        said = statements(problem, clash)
        if all(len(edges) == 2 for edges in said):
            continue  # equalities alone are examined first
        points = {end for edges in said for u, v, _ in edges for end in (u, v)}
        walk = one.copy()
        for length in range(1, len(said)):
            assert all(walk[p, p] <= 1e-7 for p in points), f"{length} would do for {in_words(clash.clauses)}"
            walk = np.maximum(walk, (walk[:, :, None] + one[None, :, :]).max(axis=1))


def test_minimal_cycles_prefer_the_short_of_two_cycles() -> None:
    body = (
        '<wait id="a" start="1"/>\n<wait id="b" start="a:end"/>\n<wait id="c" start="b:end"/>\n'
        '<wait id="d" start="c:end"/>\n'
        '<constraint id="k"><before ref="a:start"><sync ref="d:start"/></before></constraint>\n'
        '<constraint id="l"><after ref="a:start + 1"><sync ref="d:start"/></after></constraint>\n'
    )
    found = schedule(body, {name: lasting(1.0, least=1.0) for name in "abcd"})
    short, long = found.warnings
    assert (short.id, long.id) == ("b1:l", "b1:k")
    assert [clause.id for clause in short.clash] == ["b1:k", "b1:l"]
    # Three waits, the references between them, and the constraint on the first and the last.
    assert len(long.clash) == 7


def test_minimal_cycles_keep_the_given_cycle_if_the_search_is_too_long() -> None:
    n = 300
    body = "".join(f'<wait id="w{k}" start="w{(k - 1) % n}:end"/>' for k in range(n))
    found = schedule(body, {f"w{k}": lasting(1.0) for k in range(n)})
    (warning,) = found.warnings
    assert warning.id == f"b1:w{n - 1}"
    assert len(warning.clash) == 2 * n
    assert "571 more such things cannot all hold" in warning.text, "but nobody has to read all that"
    assert len(warning.text) < 2000


def test_simple_cycle_leaves_out_a_walk_round_another_cycle() -> None:
    link = Link(0, 0, 0.0)
    there, back = (1, 1.0, link), (0, 1.0, link)
    around = [(2, 1.0, link), (1, -1.0, link)]
    assert _simple(0, [there, *around, (3, 0.0, link), (1, 0.0, link), back]) == [there, back]
    assert _simple(0, [there, (2, 1.0, link), (1, 1.0, link), back]) == [(2, 1.0, link), (1, 1.0, link)]
