"""Tests of the surface map of a skin."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_surface_of_lets_light_through_ears_and_not_through_lids(skin: Skin) -> None:
    thick = surface_of(skin, relief_of(skin, lines_of(skin)))[:, 2]
    near = np.clip(skin.around("3.7", "3.12", "8.3", "8.4", radii=(0.015, 0.015, 0.03)), 0, 1) > 0.1
    assert thick[near].min() > 0.9
    assert thick.min() < 0.5
