"""Tests of the skin of a person at the texels of its maps."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.skin.skin import Skin, distance_through

pytestmark = pytest.mark.xdist_group("mask")


def at(skin: Skin, name: str) -> int:
    """Return the texel nearest to a feature point."""
    return int(np.argmin(np.linalg.norm(skin.at - skin.person.figure.point(name), axis=1)))


def test_red_is_on_the_lips_only(skin: Skin) -> None:
    assert skin.red.max() > 0.9
    assert skin.red[at(skin, "4.1")] == 0
    assert skin.red[at(skin, "9.3")] == 0


def test_around_is_1_at_a_point_and_0_far_from_it(skin: Skin) -> None:
    share = skin.around("5.3", radii=(0.02, 0.02, 0.02))
    assert share[at(skin, "5.3")] > 0.5
    assert share[at(skin, "5.4")] == 0


def test_pores_are_largest_on_the_nose(skin: Skin) -> None:
    pored = skin.pored()
    assert pored[at(skin, "9.3")] > pored[at(skin, "5.3")] > 0
    assert skin.oily().max() <= 1


def test_mark_draws_more_small_marks_than_large_ones(skin: Skin) -> None:
    found, radius = skin.mark("freckles", np.ones(len(skin.at)), 1)
    least, most = skin.table["freckles"]["radius"]
    assert len(found) > 50
    assert least <= radius.min() < np.median(radius) < (least + most) / 2


def test_noise_is_the_person_s_own(skin: Skin) -> None:
    assert (skin.noise(0.01, 1) == skin.noise(0.01, 1)).all()
    assert (skin.noise(0.01, 1) != skin.noise(0.01, 2)).any()


def test_distance_through_a_plate_is_its_thickness() -> None:
    side = np.arange(5) * 0.001
    front = np.stack([*np.meshgrid(side, side), np.zeros((5, 5))], -1).reshape(-1, 3)
    places = np.vstack([front, front - [0, 0, 0.003]])
    ups = np.repeat([[0, 0, 1.0], [0, 0, -1.0]], 25, axis=0)
    assert distance_through(places, ups, np.arange(50), 0.01) == pytest.approx(0.003)
    assert distance_through(places, ups, np.arange(25), 0.01)[:25] == pytest.approx(0.01)
