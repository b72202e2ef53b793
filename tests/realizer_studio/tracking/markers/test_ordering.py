"""Tests of `realizer_studio.tracking.markers.ordering`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.tracking.markers.layout import wojdel
from realizer_studio.tracking.markers.ordering import Order, locate, nearest, order
from tests.painted import acted, hidden, layout_in_pixels, truth


def seen(places: np.ndarray, seed: int = 0, gone: np.ndarray | None = None) -> np.ndarray:
    """Return points (31, 2) as blobs in any order, without hidden ones."""
    rows = np.column_stack([places, wojdel().colours])
    rows = rows if gone is None else rows[~gone]
    return np.random.default_rng(seed).permutation(rows)


def test_order_is_right_where_dots_are_hidden() -> None:
    way = truth("ada", acted(60)) * (1, -1)
    gone = hidden(60, 0.04, 3)
    gone[0] = False
    blobs = [seen(places, k, gone[k]) for k, places in enumerate(way)]
    found = order(blobs, layout_in_pixels("ada"), 0)
    assert np.isnan(found[gone]).all()
    assert found[~gone] == pytest.approx(way[~gone])


def test_order_goes_back_from_the_picture_at_rest() -> None:
    way = truth("ada", acted(20)) * (1, -1)
    found = order([seen(places) for places in way], layout_in_pixels("ada").with_positions(way[12]), 12)
    assert found == pytest.approx(way)


def test_order_ignores_other_blobs_and_follows_a_head_that_moves() -> None:
    rest = layout_in_pixels("ada")
    follow = Order(rest)
    for k in range(10):
        moved = rest.positions + np.array([7.0 * k, -5.0 * k])
        noise = np.array([[700.0, -20, 0], [30, -500, 1], [*(moved[0] + (0, 20)), 0]])
        assert follow(np.vstack([seen(moved), noise])) == pytest.approx(moved)


def test_order_finds_a_face_again_that_was_away() -> None:
    rest = layout_in_pixels("ada")
    follow = Order(rest)
    assert np.isnan(follow(np.zeros((0, 3)))).all()
    away = rest.positions + np.array([150, -60])
    assert follow(seen(away)) == pytest.approx(away)


def test_order_keeps_the_constraints_of_the_face() -> None:
    rest = layout_in_pixels("ada")
    gone = np.zeros(31, bool)
    gone[19] = True  # the nose is hidden, and something green appears above the eyes near a brow
    false = np.array([[*(rest.positions[3] + (4, 14)), 0]])
    found = Order(rest)(np.vstack([seen(rest.positions, 0, gone), false]))
    assert np.isnan(found[19]).all()
    assert found[~gone] == pytest.approx(rest.positions[~gone])


@pytest.mark.parametrize("turn", [-20, 0, 15])
def test_locate_lays_the_layout_on_a_turned_face(turn: int) -> None:
    angle = np.radians(turn)
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    places = layout_in_pixels("ben").positions @ matrix.T * 0.7 + (100, 20)
    blobs = seen(places)
    placed, off = locate(wojdel(), blobs)
    assert placed is not None
    assert nearest(placed, wojdel(), blobs) == pytest.approx(places)
    assert off < 0.1 * wojdel().with_positions(places).size


def test_locate_finds_nothing_among_few_blobs() -> None:
    assert locate(wojdel(), np.zeros((5, 3))) == (None, np.inf)
