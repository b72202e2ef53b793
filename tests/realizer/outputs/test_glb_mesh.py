"""Tests of the drawn mesh as primitives of a glTF file."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.core.colours import linear
from realizer.face.glb_file import GlbFile
from realizer.face.maps import Maps
from realizer.face.model import Face
from realizer.outputs.glb_mesh import GlbMesh, Look, Materials
from realizer.outputs.morph_targets import MorphTargets
from realizer_studio.faces.arkit.gltf import Gltf


def webp(colour: tuple[int, ...], mode: str) -> bytes:
    out = io.BytesIO()
    Image.new(mode, (32, 32), colour).save(out, "WEBP", lossless=True, exact=True)
    return out.getvalue()


def maps_of(**files: bytes) -> Maps:
    none = np.zeros((0, 3, 2), np.float32)
    return Maps(files, none, 0.001, 0.001, none[:, 0, 0] > 0, none[:, 0])


def picture(materials: Materials, file: GlbFile, folder: Path, info: dict[str, int]) -> np.ndarray:
    """Return the picture behind a texture of a material."""
    document = materials.document()
    (folder / "x.glb").write_bytes(file.bytes_of({"asset": {"version": "2.0"}, **document}))
    pixels = Gltf(folder / "x.glb").pixels(document["textures"][info["index"]]["source"])
    return np.asarray(pixels, int)


def test_materials_use_the_maps_as_gltf_names_them(tmp_path: Path) -> None:
    file = GlbFile()
    maps = maps_of(
        albedo=webp((200, 150, 120, 40), "RGBA"), surface=webp((90, 180, 30), "RGB"),
        normal=webp((128, 200, 230), "RGB"),
    )  # fmt: skip
    materials = Materials(file, maps, np.array([[0.5, 0.5], [0.7, 0.9]], np.float32))
    materials.add(Look("skin", 0.8, False, False, True))
    materials.add(Look("hair", 1.0, True, True, True))
    skin, hair = materials.document()["materials"]
    surface = skin["pbrMetallicRoughness"]
    assert (surface["roughnessFactor"], surface["metallicFactor"]) == (0.8, 0)
    seen = {
        name: picture(materials, file, tmp_path, info)
        for name, info in (
            ("colour", surface["baseColorTexture"]), ("rough", surface["metallicRoughnessTexture"]),
            ("shade", skin["occlusionTexture"]), ("normal", skin["normalTexture"]),
            ("cut", hair["pbrMetallicRoughness"]["baseColorTexture"]),
        )
    }  # fmt: skip
    assert seen["colour"][16, 16] == pytest.approx([200, 150, 120, 255], abs=2)
    assert seen["rough"][16, 16, 1] == pytest.approx(180, abs=2)
    assert seen["shade"][16, 16, 0] == pytest.approx(90, abs=2)
    assert seen["normal"][16, 16, :3] == pytest.approx([128, 200, 230], abs=4)
    assert seen["cut"][20, 18].tolist() == [200, 150, 120, 40]
    assert seen["cut"][2, 2].tolist() == [255] * 4
    assert (hair["alphaMode"], hair["alphaCutoff"], hair["doubleSided"]) == ("MASK", 0.5, True)


def test_materials_without_maps_have_no_textures() -> None:
    materials = Materials(GlbFile(), None, np.zeros((0, 2), np.float32))
    assert materials.add(Look("skin", 0.5, False, False, False)) == 0
    assert materials.document() == {
        "materials": [
            {
                "name": "skin",
                "doubleSided": False,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
            }
        ]
    }


@pytest.fixture
def face(balls: tuple[Face, np.ndarray]) -> Face:
    return replace(balls[0], basis={"head": np.full((len(balls[0].vertices), 1), 0.25, np.float32)})


def read(folder: Path, file: GlbFile) -> Gltf:
    (folder / "x.glb").write_bytes(file.bytes_of({"asset": {"version": "2.0"}}))
    return Gltf(folder / "x.glb")


def test_rigid_mesh_is_a_part_about_its_centre(tmp_path: Path, face: Face) -> None:
    file, centre = GlbFile(), np.array([0.032, 0, -0.015], np.float32)
    mesh = GlbMesh(file, face)
    (primitive,) = mesh.rigid(mesh.part("left_eye"), "eye", centre)["primitives"]
    found, eye = read(tmp_path, file), slice(*face.parts["left_eye"])
    at, ups, colours = (found.accessor(primitive["attributes"][k]) for k in ("POSITION", "NORMAL", "COLOR_0"))
    assert at == pytest.approx(face.vertices[eye] - centre)
    assert np.linalg.norm(ups, axis=1) == pytest.approx(1, abs=1e-5)
    assert colours[:, :3] == pytest.approx(linear(face.colours[eye]), abs=1e-4)
    (material,) = mesh.materials.document()["materials"]
    assert (material["name"], material["doubleSided"]) == ("left_eye", False)
    triangles = found.accessor(primitive["indices"]).reshape(-1, 3)
    own = face.triangles[(face.triangles >= eye.start).all(axis=1) & (face.triangles < eye.stop).all(axis=1)]
    assert {tuple(row) for row in triangles} == {tuple(row) for row in own - eye.start}


def test_rigid_mesh_is_darker_by_occlusion(tmp_path: Path, face: Face) -> None:
    file = GlbFile()
    mesh = GlbMesh(file, replace(face, occlusion=np.full(len(face.vertices), 0.5, np.float32)))
    (primitive,) = mesh.rigid(mesh.part("left_eye"), "eye")["primitives"]
    colours = read(tmp_path, file).accessor(primitive["attributes"]["COLOR_0"])
    assert colours[:, :3] == pytest.approx(linear(face.colours[slice(*face.parts["left_eye"])]) / 2, abs=1e-4)


def test_morphing_mesh_has_targets_and_two_joints(tmp_path: Path, face: Face) -> None:
    moves = np.zeros((1, *face.vertices.shape), np.float32)
    first, last = face.parts["left_eye"]
    moves[0, first + 5] = (0, 0.01, 0)
    none = np.zeros((0, 3), np.float32)
    made = MorphTargets(("up",), moves, none[:, :1], none, np.zeros((0, 2, 2), np.float32), none[:, :2])
    file = GlbFile()
    mesh = GlbMesh(file, face)
    morphing = mesh.morphing(mesh.part("left_eye"), made)
    (primitive,) = morphing["primitives"]
    found = read(tmp_path, file)
    assert morphing["extras"] == {"targetNames": ["up"]}
    assert morphing["weights"] == [0.0]
    assert found.accessor(primitive["targets"][0]["POSITION"]) == pytest.approx(moves[0, first:last])
    assert found.accessor(primitive["attributes"]["WEIGHTS_0"])[0].tolist() == [0.75, 0.25, 0, 0]
    assert found.accessor(primitive["attributes"]["JOINTS_0"])[0].tolist() == [0, 1, 0, 0]


def test_mapped_mesh_has_places_and_tangents_along_u(tmp_path: Path, face: Face) -> None:
    low, size = face.bounds[0][:2], np.ptp(face.bounds, axis=0)[:2]
    uv = ((face.vertices[:, :2] - low) / size * [1, -1] + [0, 1]).astype(np.float32)[face.triangles]
    files = {"albedo": b"", "relief": b""}
    holes = np.zeros(len(uv), bool)
    maps = Maps(files, uv, 0.001, 0.001, holes, np.zeros((len(face.vertices), 0), np.float32))
    file = GlbFile()
    mesh = GlbMesh(file, replace(face, maps=maps))
    mesh.materials.add = lambda look: 0  # type: ignore[method-assign]
    (primitive,) = mesh.rigid(mesh.part("left_eye"), "eye")["primitives"]
    found = read(tmp_path, file)
    at, ups, tangents, places = (
        found.accessor(primitive["attributes"][k]) for k in ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_0")
    )
    assert places[:, 0] == pytest.approx((at[:, 0] - low[0]) / size[0], abs=1e-4)
    front = ups[:, 2] > 0.8
    assert tangents[front, 0].min() > 0.5  # u goes to the right
    assert (tangents[front, 3] == 1).all()  # and v down, as in an upright picture
    assert np.abs((tangents[:, :3] * ups).sum(axis=1)).max() < 1e-4
