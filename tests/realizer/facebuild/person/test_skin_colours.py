"""Tests of skin colours."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.person.skin_colours import LIT, occlusion, paint_mouth


def test_paint_mouth_darkens_to_the_back_and_leaves_the_skin() -> None:
    deep = np.array([0.0, 0.01, 0.03, 0.08, 0.0])
    share = np.array([1.0, 1, 1, 1, 0])
    out, gloss, light = np.full((5, 3), 50.0), np.full(5, 0.2), np.full(5, 0.25)
    paint_mouth(out, gloss, light, share, deep, {"mouth": [120, 48, 44], "tongue": [196, 104, 100]})
    assert (np.diff(light[:4]) < 0).all()
    assert (np.diff(out[:4], axis=0) < 0).all()
    assert light[0] == pytest.approx(LIT[1])
    assert (out[4] == 50).all()
    assert gloss[3] == pytest.approx(0)
    assert (gloss[4], light[4]) == (0.2, 0.25)


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
