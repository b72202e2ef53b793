"""Tests of brows."""

import numpy as np
import pytest

from realizer.facebuild.hair.brows import brow
from realizer.facebuild.person.recipe import appearance_of

Skin = tuple[np.ndarray, np.ndarray]


def made(skin: Skin, points: dict[str, np.ndarray], side: int = 1, **look: float) -> np.ndarray:
    rng = np.random.default_rng(3)
    return brow(skin, skin, points, side, [60, 40, 30], appearance_of(look), rng).places


def test_brow_lies_on_the_skin_above_the_eye(skin: Skin, points: dict[str, np.ndarray]) -> None:
    from scipy.spatial import cKDTree

    at = made(skin, points)
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
    plain, other = made(skin, points)[:, axis].mean(), made(skin, points, **look)[:, axis].mean()
    assert sign * (other - plain) > 0.0008


def test_brow_thins_with_its_cover(skin: Skin, points: dict[str, np.ndarray]) -> None:
    assert len(made(skin, points, brow_cover=0.5)) < 0.6 * len(made(skin, points))
