"""Tests of the wet line between lower lids and eyes."""

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.drawn_mesh import WET, drawn_mesh
from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles, vertex_normals
from tests.shipped import FACES

DEEPEST = 0.0003  # m


@pytest.mark.parametrize("name", FACES)
def test_tears_lie_between_the_lower_lids_and_the_eyes(name: str) -> None:
    face = load_face(name)
    mesh, at = drawn_mesh(face), face.vertices.astype(float)
    first, last = face.parts["tears"]
    strip = at[first:last]
    assert (mesh.kind[slice(*mesh.parts["tears"])] == WET).all()
    ups = vertex_normals(strip, part_triangles(face.triangles, face.parts["tears"]))
    for eye, (_, centre) in enumerate(face.basis["eyes"]):
        mine = (strip[:, 0] > 0) == (eye == 0)
        away = strip[mine] - centre
        room = np.linalg.norm(away, axis=1) - face.basis["bulges"][eye][2]
        assert 0 < room.min() < np.median(room) < 0.0005
        assert ((ups[mine] * away).sum(axis=1) > 0).mean() > 0.9  # in the corners it is aslant
        low = face.points["3.3" if eye == 0 else "3.4"][1]
        assert low - 0.001 < strip[mine, 1].min() < low + 1e-5 < strip[mine, 1].max()


@pytest.mark.parametrize("name", FACES)
def test_tears_follow_the_lid_and_stay_before_the_eye(name: str) -> None:
    face = load_face(name)
    first, last = face.parts["tears"]
    pose = np.zeros((1, 68), np.float32)
    pose[0, [20, 21]], pose[0, [24, 25]] = 300, 40000
    at = deform(face, pose)[0].astype(float)
    risen = at[first:last] - face.vertices[first:last]
    assert risen[:, 1].max() == pytest.approx(300 * face.fapu.metres("IRISD"), rel=0.1)
    for eye, (_, centre) in enumerate(face.basis["eyes"]):
        mine = (face.vertices[first:last, 0] > 0) == (eye == 0)
        away = np.linalg.norm(at[first:last][mine] - centre, axis=1)
        assert away.min() > face.basis["bulges"][eye][2] - DEEPEST
