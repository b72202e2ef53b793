"""Tests of groups whose least squares solution violates an inequality."""

import numpy as np
import pytest

from realizer.scheduling.groups import Group, groups_of, slides, solve_groups
from realizer.scheduling.model import Model, model_of
from realizer.scheduling.rigid_clusters import RigidClusters, clusters_of
from tests.realizer.scheduling.recipes import Body, Recipe, Spot, built

FREE = Body([1.0, 1.0], 0.2, 1.0, False, None)


def clusters(recipe: Recipe) -> tuple[Model, RigidClusters]:
    model = model_of(built(recipe))
    assert isinstance(model, Model)
    return model, clusters_of(model)


def test_solve_groups_keeps_a_greatest_length() -> None:
    """The gaps are 1.5 and stiffnesses 1 and 2; the first would be 4 / 3 without a bound."""
    model, found = clusters(Recipe([FREE._replace(most=1.25)], [], [], [((0, 0), 0.0), ((0, 2), 2.5)]))
    assert np.diff(found.at[1:]).max() > 1.25
    assert solve_groups(model, found, [Group([0], [], True)]) == []
    assert found.at[1:] == pytest.approx([0, 1.25, 2.5])


def test_solve_groups_lets_a_stated_length_win_over_least_gaps() -> None:
    model, found = clusters(Recipe([FREE], [], [], [((0, 0), 1.0), ((0, 2), 1.1)]))
    assert solve_groups(model, found, [Group([0], [], True)]) == []
    assert found.at[1] == pytest.approx(1.0)
    assert found.at[3] == pytest.approx(1.1)
    assert (np.diff(found.at[1:]) >= -1e-9).all()


def test_solve_groups_returns_the_cycle_of_an_impossible_group() -> None:
    recipe = Recipe([FREE._replace(most=1.5), FREE], [], [], [((0, 0), 0.0), ((0, 2), 4.0), ((1, 0), 0.0)])
    model, found = clusters(recipe)
    before = found.at.copy()
    (cycle,) = solve_groups(model, found, [Group([int(found.label[0])], [], True)])
    assert {(link.u, link.v, link.seconds) for link in cycle} == {(2, 1, -1.5), (3, 2, -1.5)}
    np.testing.assert_array_equal(found.at, before)


def test_solve_groups_shares_the_strain_of_a_circle_of_orders() -> None:
    """Both begin at once and end at once, though one prefers 1 s and the other 2 s."""
    one, two = Body([1.0], 0.0, 1.0, False, None), Body([2.0], 0.0, 1.0, False, None)
    recipe = Recipe([one, two], [], [((0, 0), (1, 0), 0.0), ((1, 1), (0, 1), 0.0)], [])
    model, found = clusters(recipe)
    assert solve_groups(model, found, [Group([0, 1], list(model.problem.orders), False)]) == []
    assert found.at[2] - found.at[1] == pytest.approx(1.5)
    assert found.at[1:3] == pytest.approx(found.at[3:5])


ONE = Body([1.0], 0.0, 1.0, False, None)
A, B, C = (((k, 0), (k, 1)) for k in range(3))


def pinned(
    *orders: tuple[Spot, Spot, float], pins: tuple[tuple[Spot, float], ...] = ()
) -> tuple[Model, RigidClusters]:
    """Three behaviours of a second; an order is (sooner, later, seconds between)."""
    model = model_of(built(Recipe([ONE] * 3, [], list(orders), list(pins))))
    assert isinstance(model, Model)
    return model, clusters_of(model)


def bound(groups: list[Group]) -> list[tuple[list[int], bool, int]]:
    """The groups with orders; one without is free to slide."""
    return [(sorted(g.clusters), g.held, len(g.orders)) for g in groups if g.orders]


def test_groups_of_no_orders_are_none() -> None:
    assert groups_of(*pinned()) == []


def test_groups_of_a_chain_of_orders_are_free() -> None:
    assert bound(groups_of(*pinned((A[1], B[0], 0.0), (B[1], C[0], 0.0)))) == []


def test_groups_of_a_circle_of_orders_are_one() -> None:
    found = groups_of(*pinned((A[1], B[0], 0.0), (B[0], A[0], 0.0), (B[1], C[0], 0.0)))
    assert bound(found) == [([0, 1], False, 2)]


def test_groups_of_orders_that_lead_to_a_fixed_cluster_are_held() -> None:
    found = groups_of(*pinned((A[1], B[0], 0.0), (B[1], C[0], 0.0), pins=((B[0], 1.0),)))
    assert bound(found) == [([0, 1], True, 1)]


def test_slides_are_by_how_much_an_order_is_broken() -> None:
    model, found = pinned((A[1], B[0], 0.5))
    ((first, second, gain),) = slides(model, found, model.problem.orders)
    assert (first, second) == (0, 1)
    assert gain == pytest.approx(1.5)
