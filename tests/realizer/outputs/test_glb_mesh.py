"""Tests of glTF meshes of a face's parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.core.colours import linear
from realizer.face.glb_file import GlbFile
from realizer.face.model import Face
from realizer.facebuild.arkit.gltf import Gltf
from realizer.outputs.glb_mesh import morphing_mesh, rigid_mesh
from realizer.outputs.morph_targets import MorphTargets


@pytest.fixture
def face(balls: tuple[Face, np.ndarray]) -> Face:
    return replace(balls[0], basis={"head": np.full((len(balls[0].vertices), 1), 0.25, np.float32)})


@pytest.fixture
def eye(face: Face) -> np.ndarray:
    mine = np.zeros(len(face.vertices), bool)
    mine[slice(*face.parts["left_eye"])] = True
    return mine


def read(tmp_path, file: GlbFile) -> Gltf:
    (tmp_path / "x.glb").write_bytes(file.bytes_of({"asset": {"version": "2.0"}}))
    return Gltf(tmp_path / "x.glb")


def test_rigid_mesh_is_a_part_about_its_centre(tmp_path, face: Face, eye: np.ndarray) -> None:
    file, centre = GlbFile(), np.array([0.032, 0, -0.015], np.float32)
    (primitive,) = rigid_mesh(file, face, eye, "eye", 3, centre)["primitives"]
    found = read(tmp_path, file)
    at, ups, colours = (found.accessor(primitive["attributes"][k]) for k in ("POSITION", "NORMAL", "COLOR_0"))
    assert at == pytest.approx(face.vertices[eye] - centre)
    assert np.linalg.norm(ups, axis=1) == pytest.approx(1, abs=1e-5)
    assert colours[:, :3] == pytest.approx(linear(face.colours[eye]), abs=1e-4)
    assert primitive["material"] == 3
    triangles = found.accessor(primitive["indices"]).reshape(-1, 3)
    own = face.triangles[eye[face.triangles].all(axis=1)]
    assert np.array_equal(triangles, own - face.parts["left_eye"][0])


def test_rigid_mesh_is_darker_by_occlusion(tmp_path, face: Face, eye: np.ndarray) -> None:
    file = GlbFile()
    dark = replace(face, occlusion=np.full(len(face.vertices), 0.5, np.float32))
    (primitive,) = rigid_mesh(file, dark, eye, "eye", 0)["primitives"]
    colours = read(tmp_path, file).accessor(primitive["attributes"]["COLOR_0"])
    assert colours[:, :3] == pytest.approx(linear(face.colours[eye]) / 2, abs=1e-4)


def test_morphing_mesh_has_targets_and_two_joints(tmp_path, face: Face, eye: np.ndarray) -> None:
    moves = np.zeros((1, *face.vertices.shape), np.float32)
    moves[0, np.flatnonzero(eye)[5]] = (0, 0.01, 0)
    none = np.zeros((0, 3), np.float32)
    made = MorphTargets(("up",), moves, none[:, :1], none, np.zeros((0, 2, 2), np.float32), none[:, :2])
    file = GlbFile()
    mesh = morphing_mesh(file, face, eye, 0, made)
    (primitive,) = mesh["primitives"]
    found = read(tmp_path, file)
    assert mesh["extras"] == {"targetNames": ["up"]}
    assert mesh["weights"] == [0.0]
    assert found.accessor(primitive["targets"][0]["POSITION"]) == pytest.approx(moves[0, eye])
    assert found.accessor(primitive["attributes"]["WEIGHTS_0"])[0].tolist() == [0.75, 0.25, 0, 0]
    assert found.accessor(primitive["attributes"]["JOINTS_0"])[0].tolist() == [0, 1, 0, 0]
