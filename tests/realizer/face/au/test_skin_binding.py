"""Tests of binding brows and lashes to the skin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from realizer.face.au.skin_binding import skin_roots
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.render.worker import triangle
from tests.shipped import FACES


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


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("unit", ["1", "2", "4"])
def test_skin_roots_bend_brows_without_steps(name: str, unit: str) -> None:
    face = load_face(name, deformer="au")
    row = np.zeros((1, len(face.inputs)), np.float32)
    row[0, [face.inputs.index(f"{unit}{side}") for side in "LR"]] = 1
    moved = deform(face, row)[0].astype(float) - face.vertices
    first, last = face.parts["brows"]
    mine = face.triangles[((face.triangles >= first) & (face.triangles < last)).all(axis=1)]
    edges = np.concatenate([mine[:, [0, 1]], mine[:, [1, 2]], mine[:, [2, 0]]])
    long = np.linalg.norm(face.vertices[edges[:, 0]] - face.vertices[edges[:, 1]], axis=1)
    apart = np.linalg.norm(moved[edges[:, 0]] - moved[edges[:, 1]], axis=1)
    # Nearest vertices would give neighbours of half a millimetre a step of one.
    assert np.percentile(apart / np.maximum(long, 2e-4), 99) < 0.9
