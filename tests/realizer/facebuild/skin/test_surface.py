"""Tests of the surface map of a skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.skin import surface
from realizer.facebuild.skin.lines import lines_of
from realizer.facebuild.skin.relief import relief_of
from realizer.facebuild.skin.skin import Skin
from realizer.facebuild.skin.surface import surface_of

pytestmark = pytest.mark.xdist_group("mask")


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
    monkeypatch.setattr(surface, "distance_through", lambda at, *_: np.zeros(len(at)))
    thick = surface_of(skin, relief_of(skin, lines_of(skin)))[:, 2]
    assert thick[skin.around("3.1", "3.2", "8.1", radii=(0.01, 0.01, 0.02)) > 0.5].min() > 0.99
    assert thick.min() < 0.1
