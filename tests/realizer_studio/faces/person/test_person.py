"""Tests of a person made of the base mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer_studio.faces.eyeball import CORNEA, cornea
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.lips import BORDER, LOWER_MIDDLE, Lips
from realizer_studio.faces.person.makehuman import BaseMesh, Figure
from realizer_studio.faces.person.person import (
    CLEAR,
    INSET,
    RISE,
    Person,
    _landmarks,
    _relaxed,
    balls,
    cleared,
    identity,
)

pytestmark = pytest.mark.xdist_group("mask")
AT = np.array([[3, 1, 0], [-3, 1, 0], [4, 1, 0], [-4, 1, 0], [0, -2, 1], [2, -2, 0], [-2, -2, 0.0]])
QUADS = {"helper-l-eye": np.array([[0, 2, 0, 2]]), "helper-r-eye": np.array([[1, 3, 1, 3]])}


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """One target for both sides, one for each."""
    folder = tmp_path / "mpfb2/targets"
    (folder / "cheek").mkdir(parents=True)
    (folder / "low.target").write_text("4 0 -1 0\n")
    (folder / "cheek/l-wide.target").write_text("5 1 0 0\n")
    (folder / "cheek/r-wide.target").write_text("6 -1 0 0\n")
    (folder / "cheek/odd.target").write_text("5 0 2 0\n")
    return tmp_path


@pytest.fixture
def mesh() -> BaseMesh:
    return BaseMesh(AT, QUADS, np.zeros((1, 2)), np.zeros((0, 4), np.int32))


def test_identity_is_in_metres_from_between_the_eyes(mesh: BaseMesh, data: Path) -> None:
    at = identity(mesh, data, {})
    assert at[:4].mean(axis=0) == pytest.approx([0, 0, 0])
    assert np.ptp(at, axis=0) == pytest.approx(np.ptp(AT, axis=0) / 10)


def test_identity_weighs_targets_of_both_sides(mesh: BaseMesh, data: Path) -> None:
    plain = identity(mesh, data, {})
    moved = identity(mesh, data, {"low": 0.5, "cheek/*wide": 1.0}) - plain
    assert moved[4] == pytest.approx([0, -0.05, 0])
    assert moved[5:] == pytest.approx(np.array([[0.1, 0, 0], [-0.1, 0, 0]]))


def test_identity_is_even_whatever_the_targets(mesh: BaseMesh, data: Path) -> None:
    at = identity(mesh, data, {"cheek/odd": 1.0})
    assert at[mesh.mirror()] == pytest.approx(at * [-1, 1, 1])


def test_relaxed_rounds_the_lower_lip_and_keeps_its_size(figure: Figure, mask_lips: Lips) -> None:
    ring = mask_lips.rings[BORDER]
    bent, middle = figure.at.copy(), ring[LOWER_MIDDLE]
    bent[middle, 1] -= 0.002
    made = _relaxed(Figure(figure.mesh, bent, figure.points, figure.shape))
    assert abs(made[middle, 1] - figure.at[middle, 1]) < 0.001
    assert np.ptp(made[ring], axis=0)[:2] == pytest.approx(np.ptp(figure.at[ring], axis=0)[:2], rel=0.1)


def test_person_turns_whole_above_the_jaw_and_not_below_the_neck(person: Person) -> None:
    turns, at = person.turns(), person.figure.at
    assert (turns[person.figure.body & (at[:, 1] > -0.05)] == 1).all()
    assert (turns[at[:, 1] < -0.24] < 0.1).all()
    middle = np.flatnonzero(person.figure.body & (at[:, 0] == 0) & (at[:, 1] < -0.05))
    order = np.argsort((at[:, 1] + 0.3 * at[:, 2])[middle])
    assert (np.diff(turns[middle[order]]) >= 0).all()


def test_landmarks_on_the_tongue_are_its_tip_its_top_and_its_sides(figure: Figure) -> None:
    at = figure.at.copy()
    tongue = np.unique(figure.mesh.quads["helper-tongue"])
    at[tongue, 1] -= 0.2 * np.abs(at[tongue, 0])
    found = _landmarks(figure.mesh, at)
    for name in ("6.1", "6.2", "6.3", "6.4"):
        assert found[name] == figure.points[name], name


@pytest.fixture(scope="module")
def with_sockets(figure: Figure) -> Figure:
    """The mask with a ball of 12 mm behind each eye, too high by 4 mm."""
    ways = np.random.default_rng(1).normal(size=(40, 3))
    ball = 0.012 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    at = np.concatenate([figure.at, *(ball + np.array([side * 0.031, 0.004, 0.02]) for side in (1, -1))])
    first = len(figure.at)
    quads = {
        f"helper-{side}-eye": first + 40 * k + np.arange(40).reshape(-1, 4) for k, side in enumerate("lr")
    }
    mesh = BaseMesh(at, {**figure.mesh.quads, **quads}, figure.mesh.texture, figure.mesh.corners)
    return Figure(mesh, at, figure.points, figure.shape)


def test_balls_stand_before_the_middle_of_the_lids(with_sockets: Figure) -> None:
    for (centre, radius), upper, lower in zip(
        balls(with_sockets), ("3.1", "3.2"), ("3.3", "3.4"), strict=True
    ):
        high, low = with_sockets.point(upper)[1], with_sockets.point(lower)[1]
        assert centre[1] == pytest.approx((high + low) / 2 + RISE * (high - low))
        assert centre[[0, 2]] == pytest.approx([0.031 * np.sign(centre[0]), 0.02])
        assert radius == pytest.approx(0.012 - INSET)


def test_cleared_lids_are_in_front_of_balls_and_corneas(figure: Figure) -> None:
    eyes = tuple((np.array([side * 0.031, 0, 0.015]), 0.012) for side in (1, -1))
    at = cleared(figure, (eyes[0], eyes[1]))
    assert (at[:, :2] == figure.at[:, :2]).all()
    for side, (centre, radius) in zip((1, -1), eyes, strict=True):
        for ring, room in zip(Lid(figure, side).rings, CLEAR, strict=False):
            before = centre + np.array([0, 0, cornea(radius)[0]])
            assert np.linalg.norm(at[ring] - centre, axis=1).min() > radius + room - 1e-9
            assert np.linalg.norm(at[ring] - before, axis=1).min() > CORNEA + room - 1e-9
