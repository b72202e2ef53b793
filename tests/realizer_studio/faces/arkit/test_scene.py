"""Tests of the surfaces of glTF scenes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.scene import read_pieces


def with_texture(glb: Any, folder: Path, alpha: int = 255) -> Any:
    """Put a triangle with a picture beside the file into a GLB."""
    glb.mesh("head", np.eye(3), np.array([[0, 1, 2]]), None, {}, "skin")
    Image.fromarray(np.full((4, 4, 4), (200, 60, 20, alpha), np.uint8)).save(folder / "skin.png")
    glb.json |= {"images": [{"uri": "skin.png"}], "textures": [{"source": 0}]}
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = glb.accessor(np.array([[0.25, 0.5], [0.75, 0.5], [0.75, 0.5]]))
    return glb


def test_read_pieces_decodes_quantised_places_in_a_turned_node(
    new_glb: Callable[[], Any], tmp_path: Path
) -> None:
    face = load_face("ada")
    glb = new_glb()
    step = 0.4 / 32767
    whole = np.rint(face.vertices / step)
    glb.mesh("head", face.vertices, face.triangles, None, {})
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["POSITION"] = glb.accessor(whole, 5122, normalized=True)
    glb.json["nodes"][0] |= {"scale": [0.4] * 3, "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476],
                             "translation": [1, 2, 3]}  # fmt: skip
    path = tmp_path / "q.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    wanted = face.vertices[:, [2, 1, 0]] * [1, 1, -1] + [1, 2, 3]
    assert np.abs(piece.vertices - wanted).max() < 2 * step


@pytest.mark.parametrize(("scale", "wanted"), [([2.0, 2.0, 2.0], [0, 1, 2]), ([-2.0, 2.0, 2.0], [2, 1, 0])])
def test_read_pieces_keeps_the_outside_of_a_reflected_head(
    new_glb: Callable[[], Any], tmp_path: Path, scale: list[float], wanted: list[int]
) -> None:
    glb = new_glb()
    glb.mesh("head", np.eye(3), np.array([[0, 1, 2]]), None, {})
    glb.json["nodes"][0] |= {"scale": scale}
    path = tmp_path / "r.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.vertices == pytest.approx(np.eye(3) * scale)
    assert piece.triangles.tolist() == [wanted]


def test_read_pieces_poses_vertices_by_their_skeleton(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = new_glb()
    at = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    glb.mesh("head", at, np.array([[0, 1, 2]]), None, {"jawOpen": np.tile([0, 0, 1.0], (3, 1))})
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = glb.accessor(np.array([[0, 1, 0, 0]] * 3), 5121)
    attributes["WEIGHTS_0"] = glb.accessor(np.array([[0.5, 0.5, 0, 0]] * 3))
    glb.json["skins"] = [{"joints": [1, 2]}]
    glb.json["nodes"][0] |= {"skin": 0}
    glb.json["nodes"] += [{"translation": [0, 2, 0]}, {"translation": [0, 4, 0]}]
    glb.json["scenes"][0]["nodes"] += [1, 2]
    path = tmp_path / "s.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.vertices == pytest.approx(at + np.array([0, 3, 0]))
    assert piece.moves["jawOpen"] == pytest.approx(np.tile([0, 0, 1.0], (3, 1)))


def test_read_pieces_keeps_the_places_in_a_texture(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = with_texture(new_glb(), tmp_path)
    path = tmp_path / "t.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.uv == pytest.approx(np.array([[0.25, 0.5], [0.75, 0.5], [0.75, 0.5]]))
    assert dict(piece.material.textures)["base"].image == 0


@pytest.mark.parametrize(("component", "most"), [(5121, 255), (5123, 65535)])
def test_read_pieces_reads_places_of_8_and_16_bits(
    new_glb: Callable[[], Any], tmp_path: Path, component: int, most: int
) -> None:
    glb = with_texture(new_glb(), tmp_path)
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = glb.accessor(
        np.array([[0, most], [most, 0], [0, 0]]), component, normalized=True
    )
    (tmp_path / "t.glb").write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(tmp_path / "t.glb"))
    assert piece.uv.tolist() == [[0, 1], [1, 0], [0, 0]]


def test_read_pieces_refuses_places_that_are_not_finite(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = with_texture(new_glb(), tmp_path)
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = glb.accessor(np.array([[np.nan, 0], [1, 0], [0, 0]]))
    (tmp_path / "t.glb").write_bytes(glb.bytes())
    with pytest.raises(FaceError, match="TEXCOORD_0: wanted 3 x 2 finite numbers, got NaN or infinity"):
        read_pieces(Gltf(tmp_path / "t.glb"))


def test_read_pieces_turns_places_as_the_extension_says(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = with_texture(new_glb(), tmp_path)
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
        "KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 1], "rotation": np.pi / 2}
    }
    (tmp_path / "t.glb").write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(tmp_path / "t.glb"))
    assert piece.uv == pytest.approx(np.array([[1.0, -0.5], [1.0, -1.5], [1.0, -1.5]]))


def test_read_pieces_draws_a_mesh_without_places_by_its_colour(
    new_glb: Callable[[], Any], tmp_path: Path
) -> None:
    glb = with_texture(new_glb(), tmp_path)
    del glb.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]
    (tmp_path / "t.glb").write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(tmp_path / "t.glb"))
    assert piece.material.textures == ()
    assert piece.notes == ("no TEXCOORD_0: textures are left out",)


@pytest.mark.parametrize(("alpha", "glass"), [(0, True), (255, False)])
def test_read_pieces_takes_a_clear_texture_for_glass(
    new_glb: Callable[[], Any], tmp_path: Path, alpha: int, glass: bool
) -> None:
    glb = with_texture(new_glb(), tmp_path, alpha)
    glb.json["materials"][0]["alphaMode"] = "BLEND"
    (tmp_path / "t.glb").write_bytes(glb.bytes())
    assert read_pieces(Gltf(tmp_path / "t.glb"))[0].glass == glass


AT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


@pytest.fixture
def packed(new_glb: Callable[[], Any], tmp_path: Path) -> Path:
    glb = new_glb()
    glb.mesh("head", np.zeros((3, 3)), np.zeros((1, 3)), None, {})
    for accessor in glb.json["accessors"]:
        del accessor["bufferView"]
    glb.json["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 7}}
    }
    glb.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    path = tmp_path / "packed.glb"
    path.write_bytes(glb.bytes())
    return path


def test_unpack_primitive_takes_what_dracopy_reads(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = SimpleNamespace(attributes=[{"unique_id": 7, "data": AT}], faces=np.array([[0, 2, 1]]))
    monkeypatch.setitem(sys.modules, "DracoPy", SimpleNamespace(decode=lambda raw: found))
    (piece,) = read_pieces(Gltf(packed))
    assert piece.vertices.tolist() == AT.tolist()
    assert piece.triangles.tolist() == [[0, 2, 1]]


def test_unpack_primitive_says_what_to_install(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(FaceError, match="pip install DracoPy, or undo it: npx @gltf-transform/cli copy"):
        read_pieces(Gltf(packed))


def test_unpack_primitive_refuses_broken_data(packed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def decode(raw: bytes) -> None:
        raise RuntimeError("no mesh")

    monkeypatch.setitem(sys.modules, "DracoPy", SimpleNamespace(decode=decode))
    with pytest.raises(FaceError, match=r"packed\.glb: .*Draco's data are broken \(no mesh\)"):
        read_pieces(Gltf(packed))
