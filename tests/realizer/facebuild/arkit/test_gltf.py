"""Odd files: read as they are meant, or refused with what to change."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.facebuild.arkit.gltf import Gltf
from realizer.facebuild.arkit.importer import look_at
from realizer.facebuild.arkit.scene import read_pieces
from realizer.tables.arkit_names import canonical, nearest

pytestmark = pytest.mark.xdist_group("fits")

WAYS = {
    "as glTF asks": np.eye(3),
    "+z up, facing +x": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]),
    "facing -z": np.diag([-1.0, 1, -1]),
}


def split(path: Path) -> tuple[dict[str, Any], bytes]:
    raw = path.read_bytes()
    size = struct.unpack_from("<I", raw, 12)[0]
    return json.loads(raw[20 : 20 + size]), raw[28 + size :]


def written(path: Path, document: dict[str, Any], data: bytes) -> Path:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    )
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)
    return path


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("scale", "unit"), [(1.0, "metres"), (10.0, "decimetres"), (100.0, "centimetres")])
def test_unit_and_facing_are_told_by_the_shapes(
    write_head: Callable[..., Path], way: str, scale: float, unit: str
) -> None:
    found = look_at(write_head(scale=scale, turn=WAYS[way], sparse=scale > 1)).found
    assert any(f"in {unit}: its eyes stand" in line for line in found)
    assert not any("exchanged" in line for line in found)


def test_a_viewers_left_and_right_are_exchanged(write_head: Callable[..., Path]) -> None:
    other = {"Left": "Right", "Right": "Left"}
    path = write_head(spell=lambda n: next((n[: -len(k)] + other[k] for k in other if n.endswith(k)), n))
    assert any("exchanged" in line for line in look_at(path).found)


def test_foreign_names_are_told_with_the_nearest_known(write_head: Callable[..., Path]) -> None:
    assert canonical("viseme_aa") is None
    assert "mouthSmileLeft" in nearest("mouthSmileLeftt")
    path = write_head(spell=lambda n: f"{n}{n}", only=("jawOpen", "mouthSmileLeft"))
    with pytest.raises(FaceError, match="wanted morph targets with ARKit's names"):
        look_at(path)


def test_a_head_without_shapes_is_refused(write_head: Callable[..., Path]) -> None:
    with pytest.raises(FaceError, match="found none; export the head with its shape keys"):
        look_at(write_head(only=()))


def test_missing_shapes_are_told_with_what_does_not_work(write_head: Callable[..., Path]) -> None:
    report = look_at(write_head(only=("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft")))
    assert any(line.startswith("browInnerUp: ") for line in report.missing)
    assert not any("jawOpen" in line for line in report.missing)


@pytest.mark.parametrize("length", [0, 3, 11, 19, 40, 5000])
def test_a_truncated_file_is_refused(ada_glb: Path, tmp_path: Path, length: int) -> None:
    path = tmp_path / "cut.glb"
    path.write_bytes(ada_glb.read_bytes()[:length])
    with pytest.raises(FaceError, match=r"cut\.glb"):
        look_at(path)


@pytest.mark.parametrize("spoil", [
    lambda d: d["asset"].update(version="1.0"),
    lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]),
    lambda d: d["accessors"][0].update(count=10**6),
    lambda d: d["accessors"][0].update(componentType=7),
    lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop("POSITION"),
    lambda d: d["meshes"][0]["primitives"][0].update(indices=9999),
    lambda d: d["nodes"][0].update(children=[0]),
    lambda d: d["buffers"][0].update(uri="http://example.org/head.bin"),
    lambda d: d["buffers"][0].update(uri="../head.bin"),
])  # fmt: skip
def test_a_broken_document_is_refused_with_the_file(
    ada_glb: Path, tmp_path: Path, spoil: Callable[[dict[str, Any]], Any]
) -> None:
    document, data = split(ada_glb)
    document["buffers"][0]["uri"] = "head.bin"
    (tmp_path / "head.bin").write_bytes(data)
    spoil(document)
    path = tmp_path / "head.gltf"
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(FaceError, match=r"head\.gltf"):
        look_at(path)


SPOILT: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "flat places": (
        lambda j: j["accessors"][j["meshes"][0]["primitives"][0]["attributes"]["POSITION"]].update(
            type="VEC2"
        ),
        "POSITION: wanted finite x, y, z",
    ),
    "a node that is nowhere": (
        lambda j: j["nodes"][0].update(translation=[float("nan"), 0, 0]),
        "POSITION: wanted finite x, y, z",
    ),
}


@pytest.mark.parametrize("name", SPOILT)
def test_places_that_are_none_are_refused_as_such(ada_glb: Path, tmp_path: Path, name: str) -> None:
    document, data = split(ada_glb)
    spoil, words = SPOILT[name]
    spoil(document)
    with pytest.raises(FaceError, match=words):
        look_at(written(tmp_path / "odd.glb", document, data))


def test_a_name_that_is_a_number_is_a_name(ada_glb: Path, tmp_path: Path) -> None:
    document, data = split(ada_glb)
    document["meshes"][0]["name"] = 3
    assert look_at(written(tmp_path / "odd.glb", document, data)).lines


def test_a_gltf_with_its_data_inside_or_beside_is_read(ada_glb: Path, tmp_path: Path) -> None:
    document, data = split(ada_glb)
    path = tmp_path / "head.gltf"
    for uri in ("head.bin", "data:application/octet-stream;base64," + base64.b64encode(data).decode()):
        (tmp_path / "head.bin").write_bytes(data)
        document["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(document), "utf-8")
        assert look_at(path).found == look_at(ada_glb).found


def test_quantised_places_in_a_scaled_and_turned_node_are_read(
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


def test_a_skeleton_puts_the_vertices_where_its_joints_are(
    new_glb: Callable[[], Any], tmp_path: Path
) -> None:
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


def test_a_texture_becomes_the_vertices_colours(new_glb: Callable[[], Any], tmp_path: Path) -> None:
    glb = new_glb()
    glb.mesh("head", np.eye(3), np.array([[0, 1, 2]]), None, {}, "skin")
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[:, :2], pixels[:, 2:] = (200, 60, 20), (10, 120, 240)
    Image.fromarray(pixels).save(tmp_path / "skin.png")
    glb.json |= {"images": [{"uri": "skin.png"}], "textures": [{"source": 0}]}
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_0"] = glb.accessor(np.array([[0.25, 0.5], [0.75, 0.5], [0.75, 0.5]]))
    path = tmp_path / "t.glb"
    path.write_bytes(glb.bytes())
    (piece,) = read_pieces(Gltf(path))
    assert piece.colours == pytest.approx(np.array([[200, 60, 20], [10, 120, 240], [10, 120, 240]]), abs=1.5)


def test_the_command_says_what_an_import_would_find(ada_glb: Path, tmp_path: Path) -> None:
    ran = CliRunner().invoke(faces, ["check", str(ada_glb)], standalone_mode=False)
    assert ran.return_value == 0
    assert "found: " in ran.output
    (tmp_path / "no.glb").write_bytes(b"glTF")
    ran = CliRunner().invoke(faces, ["check", str(tmp_path / "no.glb")], standalone_mode=False)
    assert ran.return_value == 1
