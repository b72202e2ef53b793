"""Tests of normals and quantised vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import list_faces, load_face
from realizer.face.mesh_geometry import grid
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


def test_normals_do_not_depend_on_the_diagonals_of_quads(face: Face) -> None:
    """Along a straight lip with mirrored halves they are alike."""
    high, forward = np.array([[0, 4, 7, 9, 10, 14], [0, 3, 4, 4, 1, -1]]) / 1000
    x = np.arange(-4, 5) * 0.006
    at = np.stack([np.tile(x, 6), np.repeat(high, 9), np.repeat(forward, 9)], axis=1)
    half = grid(6, 9)[at[grid(6, 9), 0].max(axis=1) < 1e-6]
    other = half + 8 - 2 * (half % 9)
    lip = replace(face, parts={}, vertices=np.float32(at), triangles=np.concatenate([half, other[:, ::-1]]))
    ups = normals(lip, lip.vertices[None])[0].reshape(6, 9, 3)[1:-1, 1:-1]
    assert np.allclose(ups, ups[:, :1], atol=1e-5)


def test_quantised_vertices_come_back_within_a_step(face: Face) -> None:
    rows = np.zeros((3, 68), np.float32)
    rows[1, [47, 48]] = 40000
    rows[2, 2] = 2000
    vertices = deform(face, rows)
    scale, offset = face_scale(face)
    assert scale < 2e-5
    back = quantise(face, vertices).astype(np.float64) * scale + offset
    assert np.abs(back - vertices).max() < scale
