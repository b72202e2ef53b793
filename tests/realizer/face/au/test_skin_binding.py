"""Tests of binding brows and lashes to the skin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from realizer.face.au.skin_binding import skin_roots
from realizer.face.model import Face
from realizer.render.worker import triangle


def hairy() -> Face:
    """One triangle of skin, and a hair that stands on its middle and bends over the edge."""
    face, skin = triangle(), [[-0.08, -0.12, 0], [0.08, -0.12, 0], [0, 0.06, 0]]
    hair = [[0.01, -0.06, 0.001], [0.012, -0.06, 0.001], [0.01, -0.06, 0.02], [0.2, -0.06, 0.03]]
    return dataclasses.replace(
        face,
        vertices=np.array(skin + hair, np.float32),
        triangles=np.array([[0, 1, 2], [3, 4, 5], [4, 6, 5]], np.int32),
        parts={"skin": (0, 3), "lashes": (3, 7)},
    )


def test_skin_roots_are_below_and_tips_follow_them() -> None:
    face = hairy()
    corners, share = skin_roots(face, "lashes")
    assert share.sum(axis=1) == pytest.approx(1)
    places = (share[:, :, None] * face.vertices[corners]).sum(axis=1)
    assert places[0] == pytest.approx([0.01, -0.06, 0], abs=1e-6)
    assert places[1] == pytest.approx([0.012, -0.06, 0], abs=1e-6)
    assert places[2] == pytest.approx(places[0], abs=1e-6)
    assert places[3] == pytest.approx(places[1], abs=1e-6)
