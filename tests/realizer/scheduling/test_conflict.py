"""Tests of conflicts and of the graph of equalities."""

from __future__ import annotations

import numpy as np

from realizer.scheduling.conflict import ConstraintGraph, Link, conflict_of
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation
from realizer.scheduling.timing import Timing
from tests.realizer.scheduling.recipes import lasting

CONSTRAINT = Part("c", "c", is_constraint=True)


def problem(*lengths: int) -> Problem:
    """Behaviours a, b, ... with so many gaps each."""
    made = Problem()
    for order, (name, gaps) in enumerate(zip("abcd", lengths, strict=False)):
        points = tuple(f"p{k}" for k in range(gaps + 1))
        timing = lasting(1.0) if gaps == 1 else Timing(points, np.ones(gaps), np.zeros(gaps), np.ones(gaps))
        made.add(Part(f"b1:{name}", name, order=order), timing, earliest=0.5)
    return made


def tie(problem: Problem, u: int, v: int) -> Relation:
    relation = Relation(u, v, 0.0, CONSTRAINT, (problem.name_of(u), "=", problem.name_of(v)))
    problem.equalities.append(relation)
    return relation


def test_loop_is_the_shortest_chain_and_the_equality_that_does_not_fit() -> None:
    made = problem(1, 1, 1)
    short = tie(made, 1, 3)
    for u, v in ((1, 5), (5, 3)):
        tie(made, u, v)
    last = tie(made, 3, 1)
    assert ConstraintGraph(made, contradicting=[3]).loop(3).relations == (short, last)


def test_cycle_connects_its_links_by_equalities() -> None:
    made = problem(1, 1)
    relations = [tie(made, 2, 3), tie(made, 4, 1)]
    found = ConstraintGraph(made).cycle([Link(1, 2, 1.0), Link(3, 4, 0.5)])
    assert found.relations == tuple(relations)
    assert [(gap.part.name, gap.seconds, gap.most) for gap in found.gaps] == [
        ("a", 1.0, False),
        ("b", 0.5, False),
    ]
    assert [part.name for part in found.parts] == ["c", "a", "b"]
    assert found.statements == 4


def test_cycle_joins_lengths_that_follow_each_other() -> None:
    made = problem(3)
    links = [Link(2, 3, 0.2), Link(3, 4, 0.3), Link(1, 2, 0.1)]
    (gap,) = ConstraintGraph(made).cycle(links).gaps
    assert (gap.begin, gap.end, round(gap.seconds, 9)) == ("p0", "p3", 0.6)


def test_cycle_joins_greatest_lengths_backwards() -> None:
    made = problem(3)
    (gap,) = ConstraintGraph(made).cycle([Link(4, 3, -0.3), Link(3, 2, -0.2)]).gaps
    assert (gap.begin, gap.end, gap.most) == ("p1", "p3", True)
    assert round(gap.seconds, 9) == 0.5


def test_conflict_of_has_the_bound_of_a_behaviour_that_starts_too_early() -> None:
    made = problem(1)
    pin = Relation(1, ORIGIN, 0.0, made.behaviours[0], ("a:start", "=", 0))
    found = conflict_of(made, [Link(ORIGIN, 1, 0.5), pin])
    assert found.relations == (pin,)
    assert found.earliest == (made.behaviours[0], "a:start", 0.5)
    assert (found.statements, [part.name for part in found.named]) == (2, ["a"])


def test_conflict_of_names_each_order_once() -> None:
    made = problem(1, 1)
    order = Relation(2, 3, 0.0, CONSTRAINT, ("b:start", "not before", "a:end"))
    link = Link(2, 3, 0.0, order)
    found = conflict_of(made, [link, link])
    assert found.relations == (order,)
    assert not found.gaps
