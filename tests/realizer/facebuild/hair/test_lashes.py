"""Tests of lashes."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.model import Face
from realizer.facebuild.hair.cards import Patch
from realizer.facebuild.hair.lashes import Margin, lashes


def made(head: Face, margin: Margin, at: np.ndarray | None = None) -> Patch:
    places = head.vertices.astype(float) if at is None else at
    return lashes(places, margin, [30, 24, 20], 1.0, np.random.default_rng(4))


def test_lashes_point_outwards_and_up_or_down(head: Face, margin: Margin) -> None:
    for upper in (True, False):
        places = made(head, replace(margin, upper=upper)).places
        lines = places.reshape(-1, 4, 2, 3).mean(axis=2)
        way = (lines[:, -1] - lines[:, 0]).mean(axis=0)
        assert way[2] > 0
        assert (way[1] > 0) == upper


def test_lashes_turn_down_as_the_lid_falls(head: Face, margin: Margin) -> None:
    at = head.vertices.astype(float)
    patch = made(head, margin)
    fallen = at.copy()
    fallen[list(margin.edge), 1] -= 0.006
    moved = ((fallen - at)[patch.skin] * patch.shares[..., None]).sum(axis=1)[:, 1].reshape(-1, 4, 2)
    assert moved[:, 0] == pytest.approx(np.full_like(moved[:, 0], -0.006))
    assert (moved[:, -1] < -0.008).all()
