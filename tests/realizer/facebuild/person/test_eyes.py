"""Tests of the eyeballs of a person."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.eyeball import CORNEA, cornea
from realizer.facebuild.person.base_mesh import Ground
from realizer.facebuild.person.eyes import CLEAR, INSET, RISE, balls, cleared
from realizer.facebuild.person.lids import Lid
from realizer.facebuild.person.makehuman import BaseMesh

pytestmark = pytest.mark.xdist_group("mask")


@pytest.fixture(scope="module")
def with_sockets(ground: Ground) -> Ground:
    """The mask with a ball of 12 mm behind each eye, too high by 4 mm."""
    ways = np.random.default_rng(1).normal(size=(40, 3))
    ball = 0.012 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    at = np.concatenate([ground.at, *(ball + np.array([side * 0.031, 0.004, 0.02]) for side in (1, -1))])
    first = len(ground.at)
    quads = {
        f"helper-{side}-eye": first + 40 * k + np.arange(40).reshape(-1, 4) for k, side in enumerate("lr")
    }
    mesh = BaseMesh(at, {**ground.mesh.quads, **quads}, ground.mesh.texture, ground.mesh.corners)
    return Ground(mesh, at, ground.points, ground.shape)


def test_balls_stand_before_the_middle_of_the_lids(with_sockets: Ground) -> None:
    for (centre, radius), upper, lower in zip(
        balls(with_sockets), ("3.1", "3.2"), ("3.3", "3.4"), strict=True
    ):
        high, low = with_sockets.point(upper)[1], with_sockets.point(lower)[1]
        assert centre[1] == pytest.approx((high + low) / 2 + RISE * (high - low))
        assert centre[[0, 2]] == pytest.approx([0.031 * np.sign(centre[0]), 0.02])
        assert radius == pytest.approx(0.012 - INSET)


def test_cleared_lids_are_in_front_of_balls_and_corneas(ground: Ground) -> None:
    eyes = tuple((np.array([side * 0.031, 0, 0.015]), 0.012) for side in (1, -1))
    at = cleared(ground, (eyes[0], eyes[1]))
    assert (at[:, :2] == ground.at[:, :2]).all()
    for side, (centre, radius) in zip((1, -1), eyes, strict=True):
        for ring, room in zip(Lid(ground, side).rings, CLEAR, strict=False):
            before = centre + np.array([0, 0, cornea(radius)[0]])
            assert np.linalg.norm(at[ring] - centre, axis=1).min() > radius + room - 1e-9
            assert np.linalg.norm(at[ring] - before, axis=1).min() > CORNEA + room - 1e-9
