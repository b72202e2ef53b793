"""Tests of beards."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.model import Face
from realizer_studio.faces.hair.cards import Patch
from realizer_studio.faces.hair.facial_hair import BEARD_CARDS, Margin, beard, lashes
from realizer_studio.faces.person.scalp import Scalp

Skin = tuple[np.ndarray, np.ndarray]


@pytest.mark.parametrize("amount", [0.2, 1.0])
def test_beard_grows_where_it_may_and_hangs_down(
    skin: Skin, scalp: Scalp, points: dict[str, np.ndarray], amount: float
) -> None:
    at = skin[0]
    where = ((at[:, 1] < points["2.3"][1]) & (at[:, 2] > -0.02) & (at[:, 1] > points["2.1"][1] - 0.02)) * 1.0
    patch = beard(
        skin, scalp, where, points, amount, np.full((BEARD_CARDS, 3), 60.0), np.random.default_rng(5)
    )
    lines = patch.positions.reshape(BEARD_CARDS, -1, 3)
    assert where[patch.skin].mean(axis=1).min() > 0.3
    assert np.median(scalp.distance(lines[:, 0])) < 0.004
    way = lines[:, -2:].mean(axis=1) - lines[:, :2].mean(axis=1)
    assert way[:, 1].mean() < 0
    assert np.linalg.norm(way, axis=1).max() == pytest.approx(0.006 + 0.024 * amount, rel=0.4)


def lash_patch(head: Face, margin: Margin, at: np.ndarray | None = None) -> Patch:
    places = head.vertices.astype(float) if at is None else at
    return lashes(places, margin, [30, 24, 20], 1.0, np.random.default_rng(4))


def test_lashes_point_outwards_and_up_or_down(head: Face, margin: Margin) -> None:
    for upper in (True, False):
        places = lash_patch(head, replace(margin, upper=upper)).positions
        lines = places.reshape(-1, 4, 2, 3).mean(axis=2)
        way = (lines[:, -1] - lines[:, 0]).mean(axis=0)
        assert way[2] > 0
        assert (way[1] > 0) == upper


def test_lashes_turn_down_as_the_lid_falls(head: Face, margin: Margin) -> None:
    at = head.vertices.astype(float)
    patch = lash_patch(head, margin)
    fallen = at.copy()
    fallen[list(margin.edge), 1] -= 0.006
    moved = ((fallen - at)[patch.skin] * patch.shares[..., None]).sum(axis=1)[:, 1].reshape(-1, 4, 2)
    assert moved[:, 0] == pytest.approx(np.full_like(moved[:, 0], -0.006))
    assert (moved[:, -1] < -0.008).all()
