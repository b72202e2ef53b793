"""Tests of groups of clusters that are solved together."""

from __future__ import annotations

import pytest

from realizer.scheduling.groups import Group, groups_of, slides
from realizer.scheduling.model import Model, model_of
from realizer.scheduling.rigid_clusters import RigidClusters, clusters_of
from tests.realizer.scheduling.recipes import Body, Recipe, Spot, built

ONE = Body([1.0], 0.0, 1.0, False, None)
A, B, C = (((k, 0), (k, 1)) for k in range(3))


def clusters(
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
    assert groups_of(*clusters()) == []


def test_groups_of_a_chain_of_orders_are_free() -> None:
    assert bound(groups_of(*clusters((A[1], B[0], 0.0), (B[1], C[0], 0.0)))) == []


def test_groups_of_a_circle_of_orders_are_one() -> None:
    found = groups_of(*clusters((A[1], B[0], 0.0), (B[0], A[0], 0.0), (B[1], C[0], 0.0)))
    assert bound(found) == [([0, 1], False, 2)]


def test_groups_of_orders_that_lead_to_a_fixed_cluster_are_held() -> None:
    found = groups_of(*clusters((A[1], B[0], 0.0), (B[1], C[0], 0.0), pins=((B[0], 1.0),)))
    assert bound(found) == [([0, 1], True, 1)]


def test_slides_are_by_how_much_an_order_is_broken() -> None:
    model, found = clusters((A[1], B[0], 0.5))
    ((first, second, gain),) = slides(model, found, model.problem.orders)
    assert (first, second) == (0, 1)
    assert gain == pytest.approx(1.5)
