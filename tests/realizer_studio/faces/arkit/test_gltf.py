"""Tests of the glTF reader, mostly with broken and unusual files."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.tables.arkit_names import canonical, nearest
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.importer import inspect_head

pytestmark = pytest.mark.xdist_group("fits")


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


def test_import_suggests_the_nearest_known_names(write_head: Callable[..., Path]) -> None:
    assert canonical("viseme_aa") is None
    assert "mouthSmileLeft" in nearest("mouthSmileLeftt")
    path = write_head(spell=lambda n: f"{n}{n}", only=("jawOpen", "mouthSmileLeft"))
    with pytest.raises(FaceError, match="wanted morph targets with ARKit's names"):
        inspect_head(path)


def test_import_refuses_a_head_without_shapes(write_head: Callable[..., Path]) -> None:
    with pytest.raises(FaceError, match="found none; export the head with its shape keys"):
        inspect_head(write_head(only=()))


def test_import_reports_missing_shapes_and_their_effect(write_head: Callable[..., Path]) -> None:
    report = inspect_head(write_head(only=("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft")))
    assert any(line.startswith("browInnerUp: ") for line in report.missing)
    assert not any("jawOpen" in line for line in report.missing)


@pytest.mark.parametrize("length", [0, 3, 11, 19, 40, 5000])
def test_gltf_refuses_a_truncated_file(ada_glb: Path, tmp_path: Path, length: int) -> None:
    path = tmp_path / "cut.glb"
    path.write_bytes(ada_glb.read_bytes()[:length])
    with pytest.raises(FaceError, match=r"cut\.glb"):
        inspect_head(path)


@pytest.mark.parametrize("spoil", [
    lambda d: d["asset"].update(version="1.0"),
    lambda d: d.update(extensionsRequired=["EXT_mesh_gpu_instancing"]),
    lambda d: d["bufferViews"][0].update(extensions={"EXT_meshopt_compression": {
        "buffer": 0, "byteLength": 9, "byteStride": 12, "count": 5, "mode": "ATTRIBUTES"}}),
    lambda d: d["accessors"][0].update(count=10**6),
    lambda d: d["accessors"][0].update(componentType=7),
    lambda d: d["meshes"][0]["primitives"][0]["attributes"].pop("POSITION"),
    lambda d: d["meshes"][0]["primitives"][0].update(indices=9999),
    lambda d: d["nodes"][0].update(children=[0]),
    lambda d: d["buffers"][0].update(uri="http://example.org/head.bin"),
    lambda d: d["buffers"][0].update(uri="../head.bin"),
    lambda d: d["buffers"][0].update(uri="\0"),
    lambda d: d["buffers"][0].update(uri=7),
    lambda d: d.update(nodes=5),
    lambda d: d["accessors"].__setitem__(0, {"componentType": 5126, "count": 2**31 - 1, "type": "MAT4"}),
    lambda d: d["meshes"][0]["primitives"][0]["attributes"].update(COLOR_0=2),
])  # fmt: skip
def test_gltf_refuses_a_broken_document_by_its_file(
    ada_glb: Path, tmp_path: Path, spoil: Callable[[dict[str, Any]], Any]
) -> None:
    document, data = split(ada_glb)
    document["buffers"][0]["uri"] = "head.bin"
    (tmp_path / "head.bin").write_bytes(data)
    spoil(document)
    path = tmp_path / "head.gltf"
    path.write_text(json.dumps(document), "utf-8")
    with pytest.raises(FaceError, match=r"head\.gltf"):
        inspect_head(path)


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
def test_gltf_refuses_places_that_are_not_finite(ada_glb: Path, tmp_path: Path, name: str) -> None:
    document, data = split(ada_glb)
    spoil, words = SPOILT[name]
    spoil(document)
    with pytest.raises(FaceError, match=words):
        inspect_head(written(tmp_path / "odd.glb", document, data))


def pictured(path: Path, raw: bytes) -> Gltf:
    path.with_suffix(".png").write_bytes(raw)
    document = {"asset": {"version": "2.0"}, "images": [{"uri": path.with_suffix(".png").name}]}
    return Gltf(written(path, document, b""))


def test_gltf_notes_a_picture_that_is_broken(tmp_path: Path) -> None:
    gltf = pictured(tmp_path / "x.glb", b"\x89PNG\r\n and no more")
    assert gltf.pixels(0) is None
    assert gltf.notes == ("images[0] x.png: no picture that can be decoded; drawn without it",)


def test_gltf_names_the_command_that_undoes_ktx2(tmp_path: Path) -> None:
    gltf = pictured(tmp_path / "x.glb", b"\xabKTX 20\xbb\r\n\x1a\n")
    with pytest.raises(FaceError, match=r"gltf-transform/cli ktxdecompress"):
        gltf.pixels(0)


def test_gltf_refuses_a_picture_without_a_place(tmp_path: Path) -> None:
    document = {"asset": {"version": "2.0"}, "images": [{"name": "iris"}]}
    gltf = Gltf(written(tmp_path / "x.glb", document, b""))
    with pytest.raises(FaceError, match=r"images\[0\] iris: wanted a uri or a bufferView, got neither"):
        gltf.pixels(0)
    with pytest.raises(FaceError, match="samplers: wanted none, as there are none, got 2"):
        gltf.item("samplers", 2)


def test_gltf_names_a_picture_that_is_missing(tmp_path: Path) -> None:
    gltf = pictured(tmp_path / "x.glb", b"")
    (tmp_path / "x.png").unlink()
    with pytest.raises(FaceError, match=r"x\.png: No such file or directory; put it beside x\.glb"):
        gltf.pixels(0)


def test_gltf_reads_a_packed_buffer_view(tmp_path: Path) -> None:
    packed = bytes([0xD1, 0, 4, 4, 0, 0, 0, 0])
    view = {"buffer": 0, "byteLength": 8, "byteStride": 2, "count": 3, "mode": "INDICES"}
    document = {
        "asset": {"version": "2.0"}, "buffers": [{"byteLength": 8}, {"byteLength": 6}],
        "bufferViews": [
            {"buffer": 1, "byteLength": 6, "extensions": {"EXT_meshopt_compression": view}}
        ],
        "accessors": [{"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"}],
    }  # fmt: skip
    assert Gltf(written(tmp_path / "x.glb", document, packed)).accessor(0).ravel().tolist() == [0, 1, 2]


def test_gltf_takes_a_number_as_a_name(ada_glb: Path, tmp_path: Path) -> None:
    document, data = split(ada_glb)
    document["meshes"][0]["name"] = 3
    assert inspect_head(written(tmp_path / "odd.glb", document, data)).lines


@pytest.mark.slow
def test_gltf_reads_data_inside_and_beside_the_document(ada_glb: Path, tmp_path: Path) -> None:
    document, data = split(ada_glb)
    path = tmp_path / "head.gltf"
    for uri in ("head.bin", "data:application/octet-stream;base64," + base64.b64encode(data).decode()):
        (tmp_path / "head.bin").write_bytes(data)
        document["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(document), "utf-8")
        assert inspect_head(path).found == inspect_head(ada_glb).found


def test_import_command_reports_without_writing(ada_glb: Path, tmp_path: Path) -> None:
    ran = CliRunner().invoke(faces, ["check", str(ada_glb)], standalone_mode=False)
    assert ran.return_value == 0
    assert "found: " in ran.output
    (tmp_path / "no.glb").write_bytes(b"glTF")
    ran = CliRunner().invoke(faces, ["check", str(tmp_path / "no.glb")], standalone_mode=False)
    assert ran.return_value == 1
