"""Tests of normals and quantised vertices."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer.face.surface import face_scale, normals, quantise

FACES = [info.name for info in list_faces()]


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def test_normals_have_length_one_and_point_outwards(face: Face) -> None:
    ups = normals(face, face.vertices[None])[0]
    assert np.allclose(np.linalg.norm(ups, axis=1), 1, atol=1e-4)
    assert ups[face.feature_points["9.3"], 2] > 0.7
    assert ups[face.feature_points["11.4"], 1] > 0.7


def test_quantised_vertices_come_back_within_a_step(face: Face) -> None:
    rows = np.zeros((3, 68), np.float32)
    rows[1, [47, 48]] = 40000
    rows[2, 2] = 2000
    vertices = deform(face, rows)
    scale, offset = face_scale(face)
    assert scale < 2e-5
    back = quantise(face, vertices).astype(np.float64) * scale + offset
    assert np.abs(back - vertices).max() < scale
