"""Tests of the bun."""

import numpy as np

from realizer.facebuild.hair.bun import bun
from realizer.facebuild.hair.style import style_of
from realizer.facebuild.person.scalp import Scalp


def test_bun_is_a_ball_behind_the_head(scalp: Scalp) -> None:
    style = style_of({"style": "bun"})
    patch = bun(scalp, style, lambda count: np.full((count, 3), 60.0), np.random.default_rng(1))
    size = np.ptp(patch.places, axis=0)
    assert (size < 3 * max(style.bun)).all()
    assert (size > min(style.bun)).all()
    assert patch.places[:, 2].mean() < scalp.middle[2] - 0.06
