"""Tests of the search for all conflicts of a large problem."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from realizer import schedule
from realizer.scheduling.conflict import Link, choose, in_words
from realizer.scheduling.feasibility import ConstraintNetwork, conflicts_of
from realizer.scheduling.problem import ORIGIN, Problem
from realizer.scheduling.solve import Solution, solve
from tests.example_counts import examples
from tests.realizer.scheduling.recipes import Body, Recipe, built, possible, wild

ONE = Body([1.0], 0.2, 1.0, False, None)


def with_own_parts(recipe: Recipe) -> Problem:
    """Return the problem of a recipe in which the behaviour of its first point states each relation."""
    problem = built(recipe)
    for relations in (problem.equalities, problem.orders):
        for k, relation in enumerate(relations):
            owner = problem.owner[relation.u or relation.v]
            if relation.part.is_constraint and owner >= 0:
                relations[k] = relation._replace(part=problem.behaviours[owner])
    return problem


@given(possible())
def test_conflicts_of_a_possible_problem_are_none(recipe: Recipe) -> None:
    assert conflicts_of(built(recipe)) == []


@examples(3)
@given(wild)
def test_conflicts_of_are_found_iff_there_is_no_solution(recipe: Recipe) -> None:
    problem = built(recipe)
    assert bool(conflicts_of(problem)) is not isinstance(solve(problem), Solution)


@examples(3)
@given(wild)
def test_conflicts_of_leave_nothing_in_conflict(recipe: Recipe) -> None:
    problem = with_own_parts(recipe)
    dropped = [choose(conflict) for conflict in conflicts_of(problem)]
    assert None not in dropped
    assert len({id(part) for part in dropped}) == len(dropped), "each conflict drops another part"
    assert isinstance(solve(problem.without(part for part in dropped if part is not None)), Solution)


@given(wild)
def test_conflicts_of_are_contradictions_by_themselves(recipe: Recipe) -> None:
    problem = with_own_parts(recipe)
    for conflict in conflicts_of(problem):
        alone = replace(problem, equalities=[], orders=[])
        for relation in conflict.relations:
            (alone.equalities if relation in problem.equalities else alone.orders).append(relation)
        alone.equalities += [r for r in problem.equalities if r.words[1] == "rigid"]
        assert not isinstance(solve(alone), Solution), in_words(conflict.clauses)


def test_conflicts_of_end_where_all_is_required() -> None:
    problem = built(Recipe([ONE] * 2, [], [], [((0, 0), 1.0), ((0, 0), 2.0), ((1, 0), 1.0), ((1, 0), 2.0)]))
    for part in problem.behaviours:
        part.required = True
    assert len(conflicts_of(problem)) == 1


def test_conflicts_of_a_large_block_drop_only_what_cannot_be() -> None:
    fitting = "".join(f'<head id="p{k}" lexeme="NOD" start="{k}"/>' for k in range(20))
    never = "".join(f'<head id="n{k}" lexeme="NOD" start="0" end="0.1" stroke="5"/>' for k in range(20))
    made = schedule(f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b">{fitting}{never}</bml>')
    assert sorted(made.times) == sorted(f"p{k}" for k in range(20))
    assert len(made.warnings) == 20
    for warning in made.warnings:
        name = warning.id.removeprefix("b:")
        assert f"{name} cannot be placed: {name}:end = 0.1" in warning.text
        assert len(warning.clash) == 3


@given(
    st.lists(
        st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(-4, 4), st.integers(0, 3)), max_size=25
    )
)
def test_network_refuses_what_contradicts_what_it_has(steps: list[tuple[int, int, int, int]]) -> None:
    """Whatever was added and removed before: an inequality is refused iff it closes a positive cycle."""
    network, present = ConstraintNetwork(6), list[Link]()
    for point in range(1, 6):
        assert not network.add(Link(ORIGIN, point, 0.0))
    for u, v, seconds, turn in steps:
        if turn == 0 and present:
            network.remove([present.pop(u % len(present))])
            continue
        link = Link(u, v, float(seconds))
        cycle = network.add(link)
        assert bool(cycle) is not holds([*present, link])
        if cycle:
            assert link in cycle
            assert sum(step.seconds for step in cycle) > 0
            assert [step.v for step in cycle] == [step.u for step in cycle[1:] + cycle[:1]]
        else:
            present.append(link)


def holds(links: list[Link]) -> bool:
    """Return whether times satisfy all inequalities, and no point is before point 0."""
    times = [0.0] * 6
    for _ in range(7):
        for link in links:
            times[link.v] = max(times[link.v], times[link.u] + link.seconds)
    return times[ORIGIN] == 0.0 and all(times[e.v] >= times[e.u] + e.seconds for e in links)
