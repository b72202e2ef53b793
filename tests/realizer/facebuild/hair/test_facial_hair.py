"""Tests of beards."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.model import Face
from realizer.facebuild.hair.cards import Patch
from realizer.facebuild.hair.facial_hair import BEARD_CARDS, Margin, beard, brow, lashes, seen_from_front
from realizer.facebuild.person.recipe import appearance_of
from realizer.facebuild.person.scalp import Scalp

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
    lines = patch.places.reshape(BEARD_CARDS, -1, 3)
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
        places = lash_patch(head, replace(margin, upper=upper)).places
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


def brow_places(skin: Skin, points: dict[str, np.ndarray], side: int = 1, **look: float) -> np.ndarray:
    rng = np.random.default_rng(3)
    return brow(skin, skin, points, side, [60, 40, 30], appearance_of(look), rng).places


def test_brow_lies_on_the_skin_above_the_eye(skin: Skin, points: dict[str, np.ndarray]) -> None:
    from scipy.spatial import cKDTree

    at = brow_places(skin, points)
    assert cKDTree(skin[0]).query(at)[0].max() < 0.008
    assert at[:, 1].min() > points["3.1"][1]
    assert (at[:, 0] > 0).all()
    assert np.ptp(at[:, 0]) > 2 * np.ptp(at[:, 1])


@pytest.mark.parametrize(
    ("look", "axis", "sign"),
    [({"brow_low": 0.003}, 1, -1), ({"brow_arch": 0.003}, 1, 1), ({"brow_gap": 0.004}, 0, 1)],
)
def test_brow_has_the_shape_of_the_look(
    skin: Skin, points: dict[str, np.ndarray], look: dict[str, float], axis: int, sign: int
) -> None:
    plain, other = (
        brow_places(skin, points)[:, axis].mean(),
        brow_places(skin, points, **look)[:, axis].mean(),
    )
    assert sign * (other - plain) > 0.0008


def test_brow_thins_with_its_cover(skin: Skin, points: dict[str, np.ndarray]) -> None:
    assert len(brow_places(skin, points, brow_cover=0.5)) < 0.6 * len(brow_places(skin, points))


AT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]]) * 0.01
TRIANGLES = np.array([[0, 1, 2], [3, 4, 5]])


def test_seen_from_front_takes_the_foremost_triangle() -> None:
    corners, shares = seen_from_front(AT, TRIANGLES, np.array([[0.0025, 0.005]]))
    assert corners.tolist() == [[3, 4, 5]]
    assert shares == pytest.approx(np.array([[0.25, 0.25, 0.5]]))


def test_seen_from_front_continues_a_triangle_beyond_its_sides() -> None:
    place = np.array([[-0.001, 0.002]])
    corners, shares = seen_from_front(AT, TRIANGLES, place)
    assert (AT[corners] * shares[..., None]).sum(axis=1)[:, :2] == pytest.approx(place)
