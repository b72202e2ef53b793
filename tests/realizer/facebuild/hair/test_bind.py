"""Tests of what cards follow."""

import numpy as np
import pytest

from realizer.face.cards import Cards
from realizer.face.model import Face
from realizer.facebuild.hair.bind import bind
from realizer.facebuild.hair.cards import Patch
from realizer.facebuild.person.scalp import Scalp


@pytest.fixture
def patch(head: Face) -> Patch:
    """A place above the crown, one beside the neck, and one 5 mm before a brow."""
    brow = head.feature_points["4.3"]
    places = np.array([[0.01, 0.13, -0.05], [0.08, -0.12, -0.05], head.vertices[brow] + [0, 0, 0.005]])
    skin, shares = np.full((3, 3), -1), np.zeros((3, 3))
    skin[2], shares[2, 0] = brow, 1
    ups = np.array([[0, 1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])
    one = np.ones(3)
    return Patch(places, ups, np.ones((3, 2)), np.ones((3, 3)), one, one, np.array([[0, 1, 2]]), skin, shares)


def followed(cards: Cards, at: np.ndarray) -> np.ndarray:
    return np.einsum("ck,ckx->cx", cards.weights.astype(float), at[cards.roots])


def bound(head: Face, patch: Patch, scalp: Scalp) -> Cards:
    return bind(patch, head.vertices.astype(float), head.triangles, scalp, head.basis["head"][:, 0], {})


def test_bind_finds_every_place_again_at_rest(head: Face, patch: Patch, scalp: Scalp) -> None:
    cards = bound(head, patch, scalp)
    assert followed(cards, head.vertices.astype(float)) == pytest.approx(patch.places, abs=1e-6)
    assert cards.weights.sum(axis=1) == pytest.approx(np.ones(3), abs=1e-6)


def test_bind_turns_hair_with_the_head(head: Face, patch: Patch, scalp: Scalp) -> None:
    at, pivot = head.vertices.astype(float), np.array(head.points["7.1"], float)
    turn = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])  # a quarter to the left
    share = head.basis["head"][:, :1]
    moved = followed(bound(head, patch, scalp), at + share * ((at - pivot) @ (turn - np.eye(3)).T))
    whole = (patch.places - pivot) @ turn.T + pivot
    assert moved[[0, 2]] == pytest.approx(whole[[0, 2]], abs=1e-5)
    assert np.linalg.norm(moved[1] - whole[1]) > 0.001  # hangs between head and bust


def test_bind_keeps_a_hair_as_long_where_its_skin_moves(head: Face, patch: Patch, scalp: Scalp) -> None:
    at = head.vertices.astype(float)
    at[head.feature_points["4.3"]] += [0.004, 0.008, 0]
    moved = followed(bound(head, patch, scalp), at)
    assert moved[2] - at[head.feature_points["4.3"]] == pytest.approx([0, 0, 0.005], abs=1e-6)
