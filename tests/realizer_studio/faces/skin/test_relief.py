"""Tests of the relief of a skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.skin.lines import lines_of
from realizer_studio.faces.skin.relief import Relief, relief_of, surface_of
from realizer_studio.faces.skin.skin import Skin

pytestmark = pytest.mark.xdist_group("mask")


@pytest.fixture(scope="module")
def relief(skin: Skin) -> Relief:
    return relief_of(skin, lines_of(skin))


def test_relief_of_stays_within_the_map_s_range(relief: Relief) -> None:
    for heights in (relief.rest, relief.folds):
        assert np.isfinite(heights).all()
        assert -0.0012 < heights.min() < -0.0001
        assert heights.max() < 0.0006


def test_relief_of_has_pores_outside_the_mouth(skin: Skin, relief: Relief) -> None:
    assert 0 < relief.pores.max() < 0.3
    assert not relief.pores[~skin.dry].any()


def test_relief_of_purses_lips_beside_their_red(skin: Skin, relief: Relief) -> None:
    beside = (skin.ring > 7.5) & skin.dry
    assert relief.folds[beside].min() < -0.00005


def test_surface_of_is_smooth_on_lips_and_dark_in_lines(skin: Skin) -> None:
    relief = relief_of(skin, lines_of(skin))
    light, rough, thick = surface_of(skin, relief).T
    assert min(light.min(), rough.min(), thick.min()) >= 0
    assert max(light.max(), rough.max(), thick.max()) <= 1
    assert rough[skin.red > 0.9].mean() < rough[(skin.red == 0) & skin.dry].mean() - 0.1
    assert light[relief.rest < np.quantile(relief.rest, 0.01)].mean() < light.mean()


def test_surface_of_lets_light_through_ears_and_not_through_lids(
    skin: Skin, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where all of the head is as thin as paper."""
    monkeypatch.setattr(
        "realizer_studio.faces.skin.relief.distance_through", lambda at, *_: np.zeros(len(at))
    )
    thick = surface_of(skin, relief_of(skin, lines_of(skin)))[:, 2]
    assert thick[skin.around("3.1", "3.2", "8.1", radii=(0.01, 0.01, 0.02)) > 0.5].min() > 0.99
    assert thick.min() < 0.1
