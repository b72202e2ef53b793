"""Tests of reading what Draco packs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.facebuild.arkit.gltf import Gltf
from realizer.facebuild.arkit.scene import read_pieces

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
