"""Tests of skin colours."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.makehuman import Figure
from realizer_studio.faces.person.skin_colours import LIT, beard, light_mouth, lining, occlusion

COLOURS = {"mouth": [120, 48, 44], "tongue": [196, 104, 100]}


def test_lining_darkens_to_the_back() -> None:
    assert (np.diff(lining(COLOURS, np.array([0.0, 0.01, 0.03, 0.08])), axis=0)[:2] < 0).all()


def test_light_mouth_lights_the_lining_only() -> None:
    light = np.full(4, 0.25)
    light_mouth(light, np.array([1.0, 1, 1, 0]), np.array([0.0, 0.03, 0.08, 0]))
    assert light[0] == pytest.approx(LIT[1])
    assert (np.diff(light[:3]) < 0).all()
    assert light[3] == 0.25


def test_beard_grows_below_the_nose_and_not_on_the_lips(figure: Figure, mask_lips: Lips) -> None:
    where = beard(figure, mask_lips)
    assert where[figure.points["2.10"]] > 0.9
    assert where[figure.points["4.1"]] == 0
    assert where[figure.points["8.1"]] < 0.1


UP = np.array([0, 0, 1.0])
SIDE = np.linspace(-0.1, 0.1, 21)
PLATE = np.stack([*np.meshgrid(SIDE, SIDE), np.zeros((21, 21))], -1).reshape(-1, 3)
CORNERS = np.arange(21 * 20).reshape(20, 21)[:, :20].ravel()
TILES = np.concatenate([CORNERS + np.array(rest)[:, None] for rest in ((0, 1, 22), (0, 22, 21))], 1).T


def sky(plate: np.ndarray, at: np.ndarray, up: np.ndarray = UP) -> np.ndarray:
    """Return the share of the sky that places (n, 3) beside a plate see, all of them turned to one way."""
    places = np.vstack([plate, at])
    return occlusion(places, np.tile(up, (len(places), 1)), TILES, directions=96, cell=0.004)[len(plate) :]


def test_occlusion_is_1_above_a_plate_and_nearly_0_below_it() -> None:
    above, below, far = sky(PLATE, UP * [[0.03], [-0.02], [-3.0]])
    assert above == pytest.approx(1, abs=0.01)
    assert below < 0.1
    assert far > 0.95


def test_occlusion_at_the_foot_of_a_wall_is_that_of_half_a_sky() -> None:
    wall = PLATE[:, [2, 0, 1]] + [0, 0, 0.1]
    assert sky(wall, np.array([[0.02, 0, 0], [-0.02, 0, 0]])) == pytest.approx(0.55, abs=0.08)
    assert sky(wall, np.array([[2.0, 0, 0]])) > 0.95


def test_occlusion_is_the_same_whichever_way_all_is_turned() -> None:
    at = np.array([[0, 0, -0.05], [0.1, 0, -0.05], [0.2, 0, -0.05]])
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert sky(PLATE @ turn, at @ turn, UP @ turn) == pytest.approx(sky(PLATE, at), abs=0.08)
