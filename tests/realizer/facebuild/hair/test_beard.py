"""Tests of beards."""

import numpy as np
import pytest

from realizer.facebuild.hair.beard import COUNT, beard
from realizer.facebuild.person.scalp import Scalp

Skin = tuple[np.ndarray, np.ndarray]


@pytest.mark.parametrize("amount", [0.2, 1.0])
def test_beard_grows_where_it_may_and_hangs_down(
    skin: Skin, scalp: Scalp, points: dict[str, np.ndarray], amount: float
) -> None:
    at = skin[0]
    where = ((at[:, 1] < points["2.3"][1]) & (at[:, 2] > -0.02) & (at[:, 1] > points["2.1"][1] - 0.02)) * 1.0
    patch = beard(skin, scalp, where, points, amount, np.full((COUNT, 3), 60.0), np.random.default_rng(5))
    lines = patch.places.reshape(COUNT, -1, 3)
    assert where[patch.skin].mean(axis=1).min() > 0.3
    assert np.median(scalp.distance(lines[:, 0])) < 0.004
    way = lines[:, -2:].mean(axis=1) - lines[:, :2].mean(axis=1)
    assert way[:, 1].mean() < 0
    assert np.linalg.norm(way, axis=1).max() == pytest.approx(0.006 + 0.024 * amount, rel=0.4)
