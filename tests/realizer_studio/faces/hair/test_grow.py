"""Tests of the hair of a head, in every style."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.tables import read_toml, text_of
from realizer_studio.faces.hair.grow import bun, cap, hair, tints
from realizer_studio.faces.hair.strands import edge
from realizer_studio.faces.hair.style import Style, style_of
from realizer_studio.faces.person.scalp import Scalp
from realizer_studio.faces.skin.skin_atlas import HAIR

STYLES = list(read_toml(text_of("hair.toml"), "hair.toml")["styles"])
BROWN = [70, 48, 36]
Skin = tuple[np.ndarray, np.ndarray]


@pytest.mark.parametrize("name", STYLES)
def test_hair_of_every_style_is_sound_and_light(skin: Skin, points: dict[str, np.ndarray], name: str) -> None:
    style = style_of({"style": name})
    scalp = Scalp(*skin, points, style.line, style.rise)
    patch = hair(scalp, skin[1], style, BROWN, np.random.default_rng(11))
    assert len(patch.triangles) < 9000
    for values in (patch.positions, patch.normals, patch.uv, patch.colours, patch.occlusion):
        assert np.isfinite(values).all()
    assert (patch.uv >= HAIR.left).all()
    assert 0 <= patch.occlusion.min() <= patch.occlusion.max() <= 1
    lift = scalp.lift(patch.positions)[0]
    assert lift[scalp.distance(patch.positions) < 0.01].min() > -0.010  # face_cards lifts what is in the skin
    before = patch.positions[
        (patch.positions[:, 2] > 0.03) & (patch.positions[:, 1] < points["11.1"][1] - 0.025)
    ]
    assert not len(before) or np.abs(before[:, 0]).min() > 0.04


def test_cap_lies_on_the_skin_under_the_hair(scalp: Scalp, skin: Skin, style: Style) -> None:
    patch = cap(scalp, skin[1], style, BROWN)
    assert edge(scalp, style, patch.positions).min() > -0.015
    assert scalp.distance(patch.positions).max() < 0.002
    assert edge(scalp, style, patch.positions).max() > 0.08


def test_tints_turn_white_lock_by_lock(style: Style) -> None:
    rng = np.random.default_rng(2)
    dark, mixed, white = (
        tints(replace(style, grey=grey), BROWN, 200, rng).mean(axis=1) for grey in (0.0, 0.5, 1.0)
    )
    assert dark.max() < mixed.min() < mixed.max() < white.min()
    assert np.ptp(mixed) > np.ptp(dark)


def test_bun_is_a_ball_behind_the_head(scalp: Scalp) -> None:
    style = style_of({"style": "bun"})
    patch = bun(scalp, style, lambda count: np.full((count, 3), 60.0), np.random.default_rng(1))
    size = np.ptp(patch.positions, axis=0)
    assert (size < 3 * max(style.bun)).all()
    assert (size > min(style.bun)).all()
    assert patch.positions[:, 2].mean() < scalp.middle[2] - 0.06
