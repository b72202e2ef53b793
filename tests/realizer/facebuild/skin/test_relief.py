"""Tests of the relief of a skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.skin.lines import lines_of
from realizer.facebuild.skin.relief import Relief, relief_of
from realizer.facebuild.skin.skin import Skin

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
