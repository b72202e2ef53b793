"""Tests of skin colours."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.person.skin_colours import LIT, paint_mouth


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
