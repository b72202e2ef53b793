"""`LampView`: a head as a lamp sees it."""

import numpy as np
import pytest

from realizer.render.lamp_view import SIDE, LampView


def test_lamp_view_holds_the_whole_box():
    view = LampView((1, 2, 3), (-1, -2, -1), (1, 1, 2))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 1) for z in (-1, 2)], np.float32)
    seen = view.project(corners)
    assert (seen[:, :2] >= 0).all()
    assert (seen[:, :2] <= SIDE).all()
    assert (seen[:, 2] >= 0).all()
    assert (seen[:, 2] <= 1).all()


def test_lamp_view_measures_depth_away_from_the_lamp():
    depths = LampView((0, 1, 0), (-1, -1, -1), (1, 1, 1)).project(np.float32([[0, 1, 0], [0, -1, 0]]))[:, 2]
    assert depths[1] - depths[0] == pytest.approx(2 / np.sqrt(12))
