"""Tests of the numeric form of a problem."""

import numpy as np
import pytest
from hypothesis import given

from realizer.scheduling.model import Model, model_of
from realizer.scheduling.problem import ORIGIN
from tests.realizer.scheduling.recipes import Body, Recipe, built, possible, spans

FREE = Body([1.0, 2.0], 0.1, 2.0, False, None)


def model(recipe: Recipe) -> Model:
    found = model_of(built(recipe))
    assert isinstance(found, Model)
    return found


def test_model_of_adds_up_lengths_and_slack_of_each_behaviour() -> None:
    found = model(Recipe([FREE, FREE], [], [], []))
    assert found.chain.tolist() == [0, 0, 1, 3, 0, 1, 3]
    assert found.slack.tolist() == [0, 0, 0.5, 0.75, 0, 0.5, 0.75]
    assert (found.first.tolist(), found.last.tolist()) == ([1, 4], [3, 6])
    assert found.owner.tolist() == [2, 0, 0, 0, 1, 1, 1]


def test_model_of_leaves_out_the_gaps_of_rigid_behaviours() -> None:
    found = model(Recipe([FREE._replace(rigid=True), FREE._replace(most=2.5)], [], [], []))
    assert found.gap.tolist() == [4, 5]
    assert found.most.tolist() == [2.5, 2.5]
    assert found.wanted.tolist() == [1, 2]


def test_model_of_contradicting_equalities_is_their_numbers() -> None:
    assert model_of(built(Recipe([FREE], [], [], [((0, 0), 1.0), ((0, 0), 1.5)]))) == [1]


def test_points_of_chosen_behaviours() -> None:
    found = model(Recipe([FREE, FREE], [], [], []))
    assert found.points_of(np.array([False, True, False])).tolist() == [4, 5, 6]


def test_stated_lengths_are_those_between_fixed_points_of_a_behaviour() -> None:
    numbers = [((0, 2), 4.0), ((0, 0), 1.0), ((1, 1), 2.0)]
    p, q, length = model(Recipe([FREE, FREE], [], [], numbers)).stated_lengths()
    assert (p.tolist(), q.tolist(), length.tolist()) == ([1], [3], [3.0])


@given(possible())
def test_model_of_a_problem_that_can_be_solved_keeps_it(recipe: Recipe) -> None:
    problem, found = built(recipe), model(recipe)
    for u, v, seconds, _, _ in problem.equalities:
        assert found.root[u] == found.root[v]
        assert found.shift[u] - found.shift[v] == pytest.approx(seconds, abs=1e-6)
    rows = zip(found.gap, found.wanted, found.least, found.most, found.stiffness, strict=True)
    assert [tuple(row) for row in rows] == [
        (s.point, s.wanted, s.least, s.most, s.stiffness) for s in spans(problem)
    ]
    assert ORIGIN not in found.tied
