"""Tests of the albedo map of a skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.skin import albedo
from realizer_studio.faces.skin.albedo import crease, paint_albedo
from realizer_studio.faces.skin.skin import Skin

pytestmark = pytest.mark.xdist_group("mask")


def test_paint_albedo_keeps_the_colour_of_the_skin_and_reddens_lips(skin: Skin) -> None:
    none = np.zeros(len(skin.at), np.float32)
    colours = paint_albedo(skin, none, none)
    forehead = np.linalg.norm(skin.at - skin.person.figure.point("9.12") - [0, 0.03, 0], axis=1) < 0.012
    assert colours[forehead].mean(axis=0) == pytest.approx(skin.recipe.colours["skin"], rel=0.08)
    lips = colours[skin.red > 0.95].mean(axis=0)
    assert lips[0] - lips[1] > colours[forehead, 0].mean() - colours[forehead, 1].mean()
    assert 0 <= colours.min() < colours.max() <= 255


def test_paint_albedo_darkens_brows(skin: Skin) -> None:
    none = np.zeros(len(skin.at), np.float32)
    light = paint_albedo(skin, none, none).mean(axis=1)
    forehead = skin.person.figure.point("9.12") + np.array([0, 0.03, 0])
    dark, plain = (
        light[np.linalg.norm(skin.at - at, axis=1) < far].mean()
        for at, far in ((skin.person.figure.point("4.3"), 0.005), (forehead, 0.012))
    )
    assert dark < 0.6 * plain


def test_paint_albedo_darkens_the_roots_of_lashes(skin: Skin, monkeypatch: pytest.MonkeyPatch) -> None:
    none = np.zeros(len(skin.at), np.float32)
    whole = paint_albedo(skin, none, none)
    monkeypatch.setattr(albedo, "LASHES", (0.0, 0.0))
    change = (paint_albedo(skin, none, none) - whole).mean(axis=1)
    assert change.max() > 10
    assert skin.margins()[0][change > 1].min() > 0.1


def test_crease_is_on_the_lips_only(skin: Skin) -> None:
    depth = crease(skin)
    assert depth.max() > 0.5
    assert not depth[skin.red == 0].any()
