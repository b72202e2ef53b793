"""`reach`: the share of the lamp that a place sees."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.render.lamp_view import SIDE, LampView
from realizer.render.shadows import AWAY, depths_of, ends_around, reach

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]
UP = np.float32([0, 1, 0])


def test_reach_is_dark_behind_and_light_before():
    """A sheet over half of the box at depth 0.3: below it is shadow, above it and beside it light."""
    view = LampView((0, 1, 0), (-1, -1, -1), (1, 1, 1))
    depths = np.ones((SIDE, SIDE, 4), np.float32)
    half = view.project(np.float32([[0, 0, 0]]))[0, 0]
    depths[:, : int(half)] = 0.3
    samples = np.where(depths < 1, (AWAY - depths).view(np.uint32).astype(np.uint64) << 32 | 1, 0)
    ends, around = np.empty((2, SIDE, SIDE, 2), np.float32)
    depths_of(samples.astype(np.uint64), (0, SIDE), depths, ends)
    ends_around(ends, (0, SIDE), around)
    shadows = depths, around, view.matrix
    left = -0.3 if view.matrix[0, 0] > 0 else 0.3

    def at(x, y):
        return reach(shadows, np.float32([x, y, 0]), UP)

    assert at(left, -0.9) < 0.01
    assert at(left, 0.9) == pytest.approx(1)
    assert at(-left, -0.9) == pytest.approx(1, abs=0.01)
    top, bottom = view.project(np.float32([[left, 1, 0], [left, -1, 0]]))[:, 2]
    assert at(left, 1 - 2 * (0.3 - top) / (bottom - top)) == pytest.approx(1), "it does not shade itself"
    edge = [at(x, -0.9) for x in np.linspace(left / 20, -left / 20, 41)]
    assert (np.diff(edge) >= -1e-3).all()
    assert any(0.2 < share < 0.8 for share in edge)
