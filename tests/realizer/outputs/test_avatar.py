"""Reading somebody's own avatar."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from realizer.face.glb_file import read_glb
from realizer.outputs.avatar import DRACO, read_avatar
from tests import avatars


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    def write(content: bytes) -> Path:
        path = tmp_path / "mine.glb"
        path.write_bytes(content)
        return path

    return write


def changed(content: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """Return a GLB file with another document."""
    document, data = read_glb(content)
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x4E4942) + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_read_avatar_finds_shapes_and_bones(written):
    found = read_avatar(written(avatars.avatar(("Mouth.jawOpen", "mouthSmile_L", "hat"))))
    assert {shape: [bind[1:] for bind in binds] for shape, binds in found.shapes.items()} == {
        "jawOpen": [(0, 1.0)],
        "mouthSmileLeft": [(1, 1.0)],
    }
    names = [node["name"] for node in found.document["nodes"]]
    assert {bone: names[node] for bone, node in found.bones.items()} == {
        bone: bone for bone in ("neck", "head", "leftEye", "rightEye")
    }
    assert not found.faces_back


def test_read_avatar_finds_bones_by_other_names(written):
    names = {"head": "mixamorig:Head", "neck": "Neck", "leftEye": "eye_L", "rightEye": "Eye.R"}

    def rename(document: dict[str, Any]) -> None:
        for node in document["nodes"]:
            node["name"] = names.get(node["name"], node["name"])

    found = read_avatar(written(changed(avatars.avatar(), rename)))
    assert found.bones.keys() == names.keys()


def test_read_avatar_ignores_a_mesh_called_head(written):
    mesh = {"name": "Head", "mesh": 0}
    found = read_avatar(written(changed(avatars.avatar(), lambda d: d["nodes"].insert(0, mesh) or shift(d))))
    assert found.document["nodes"][found.bones["head"]].get("mesh") is None


def shift(document: dict[str, Any]) -> None:
    """Correct the numbers of nodes after one was put before them."""
    for holder in (*document["nodes"], *document["scenes"]):
        for name in ("children", "nodes"):
            if name in holder:
                holder[name] = [k + 1 for k in holder[name]]
    document["skins"][0]["joints"] = [k + 1 for k in document["skins"][0]["joints"]]


def test_read_avatar_leaves_eyes_to_shapes_that_move_them(written):
    assert read_avatar(written(avatars.avatar(eye_shapes=True))).bones.keys() == {"neck", "head"}


@pytest.mark.parametrize("vrm", [0, 1])
def test_read_avatar_finds_the_expressions_of_vrm(written, vrm):
    content = avatars.avatar(("a", "b"), vrm=vrm, expressions={"aa": "a", "happy": "b"}, twist=3)
    found = read_avatar(written(content))
    assert {name: [bind[1:] for bind in binds] for name, binds in found.expressions.items()} == {
        "aa": [(0, 1.0)],
        "happy": [(1, 1.0)],
    }
    assert (found.shapes, found.faces_back) == ({}, vrm == 0)
    assert found.bones.keys() == {"neck", "head", "leftEye", "rightEye"}


@pytest.mark.parametrize("vrm", [0, 1])
def test_read_avatar_finds_arkit_shapes_among_expressions(written, vrm):
    content = avatars.avatar(("a", "b"), vrm=vrm, expressions={"JawOpen": "b"})
    assert [bind[1:] for bind in read_avatar(written(content)).shapes["jawOpen"]] == [(1, 1.0)]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "wanted a GLB file"),
        (b"<bml/>" * 10, "wanted a GLB file"),
        (avatars.avatar()[:-50], "it is truncated"),
        (avatars.avatar()[:12], "wanted a GLB header, got 12 bytes: it is truncated"),
        (changed(avatars.avatar(), lambda d: d.pop("buffers")), "got one without data"),
        (avatars.avatar(()), "mouthSmileLeft, or VRM's expressions, got no morph targets"),
        (avatars.avatar(("smile", "frown")), "got smile, frown"),
        (avatars.avatar([f"s{k}" for k in range(9)]), "s7, ..."),
        (changed(avatars.avatar(), lambda d: d["buffers"][0].update(uri="x.bin")), "data beside it"),
        (changed(avatars.avatar(), lambda d: d["nodes"][-1].update(mesh=99)), "IndexError"),
        (
            changed(avatars.avatar(), lambda d: d["accessors"][0].update(bufferView=99)),
            "in accessors[0], got 99",
        ),
        (
            changed(avatars.avatar(), lambda d: d["bufferViews"][1].update(byteLength=1 << 20)),
            "bufferViews[1]",
        ),
        (
            changed(avatars.avatar(), lambda d: d["meshes"][1]["primitives"][0].update(indices=99)),
            "a mesh, got 99",
        ),
        (changed(avatars.avatar(), lambda d: d.update(extensionsRequired=[DRACO])), "not packed with Draco"),
        (changed(avatars.avatar(), lambda d: d.pop("nodes")), "KeyError: 'nodes'"),
        (changed(avatars.avatar(), lambda d: d["nodes"][3].update(children=[0])), "RecursionError"),
        (changed(avatars.avatar(), lambda d: d["meshes"][1].update(extras={"targetNames": 7})), "TypeError"),
    ],
)
def test_read_avatar_says_what_is_wrong(written, content, reason):
    with pytest.raises(ValueError, match=r"^avatar: .*mine\.glb: wanted") as error:
        read_avatar(written(content))
    assert reason in str(error.value)


def test_avatar_missing_lists_what_nothing_shows(written):
    missing = read_avatar(written(avatars.avatar(("jawOpen", "eyeBlinkLeft")))).missing
    assert missing[:2] == ("eyeBlinkRight", "mouthFunnel")
    assert len(missing) == 42  # bones turn the eyes
    content = avatars.avatar(("a",), vrm=1, expressions={"aa": "a"})
    assert read_avatar(written(content)).missing == ()


def test_read_avatar_of_no_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_avatar(tmp_path / "none.glb")
