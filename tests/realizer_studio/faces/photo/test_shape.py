"""Tests of the places of landmarks, and of how a camera sees them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer_studio.faces.person.sliders import person_faults
from realizer_studio.faces.photo.shape import DISTANCE, LandmarkAnchors, Pose, Sliders


def test_places_are_shares_of_three_vertices() -> None:
    front, side = LandmarkAnchors.of("front"), LandmarkAnchors.of("side")
    assert front.numbers.tolist() == list(range(468))
    assert 200 < len(side.numbers) < 468
    for places in (front, side):
        assert places.shares.sum(axis=1) == pytest.approx(1)
        assert places.shares.min() > -0.01
    assert front.subset(front.numbers == 7).corners.tolist() == [front.corners[7].tolist()]


def test_pose_turns_to_the_left_and_shrinks_with_distance() -> None:
    pose = Pose(np.array([0, np.pi / 2, 0]), 100.0, np.array([50.0, 60.0]))
    (nose, up, ear), near = pose([[0, 0, 0.1], [0, 0.1, 0], [-DISTANCE / 2, 0, 0]])
    assert nose == pytest.approx([60, 60])  # at the right of the picture
    assert up == pytest.approx([50, 50])
    assert near == pytest.approx([0, 0, DISTANCE / 2])
    assert ear == pytest.approx([50, 60])


def test_sliders_give_a_person_within_the_bounds(data: Path) -> None:
    sliders = Sliders(data, {"age": 30}, np.arange(3))
    person = sliders.person(np.full(len(sliders.names), 99.0))
    assert person_faults(person) == []
    assert (person["age"], person["sex"]) == (30, 1)


def test_sliders_move_the_mesh(data: Path) -> None:
    places = LandmarkAnchors.of("front")
    sliders = Sliders(data, {}, places.corners)
    plain = sliders.person(np.zeros(len(sliders.names)))
    wide = plain | {"nose_width": 1.0}
    one, other = (places.positions(sliders.mesh(person)) for person in (plain, wide))
    assert 0.001 < np.abs(one - other).max() < 0.05
