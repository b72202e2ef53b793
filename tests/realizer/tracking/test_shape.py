"""Tests of shapes of faces without their pose."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import rotations
from realizer.tracking.regressor import stored
from realizer.tracking.shape import UP, head_angles, upright


def test_shapes_are_those_of_the_head_in_any_pose() -> None:
    head = stored()["head"]
    angles = np.array([[0.2, -0.1, 0.3], [-0.4, 0.6, 0.0]])
    turns = rotations(*angles.T.astype(np.float32))
    pixels = (np.einsum("nij,pj->npi", turns, head) * 70 + (10, -20, 5)) * UP
    found, shapes = upright(pixels, head)
    assert head_angles(found) == pytest.approx(angles, abs=1e-5)
    assert shapes[1] == pytest.approx(head, abs=1e-4)
