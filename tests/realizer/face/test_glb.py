"""Tests of a face as a GLB file."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from realizer.face.glb import to_glb
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face

FACES = [info.name for info in list_faces()]


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def test_to_glb_holds_mesh_colours_and_parts(face: Face) -> None:
    glb = to_glb(face)
    magic, version, length = struct.unpack_from("<III", glb)
    assert (magic, version, length) == (0x46546C67, 2, len(glb))
    size, kind = struct.unpack_from("<II", glb, 12)
    assert kind == 0x4E4F534A
    document = json.loads(glb[20 : 20 + size])
    data_size, kind = struct.unpack_from("<II", glb, 20 + size)
    data = glb[28 + size :]
    assert kind == 0x004E4942
    assert data_size == len(data) == document["buffers"][0]["byteLength"]
    (primitive,) = document["meshes"][0]["primitives"]

    def array(number: int) -> np.ndarray:
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        kinds = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
        raw = data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.frombuffer(raw, kinds[accessor["componentType"]]).reshape(accessor["count"], -1)

    attributes = primitive["attributes"]
    assert np.array_equal(array(attributes["POSITION"]), face.vertices)
    assert np.array_equal(array(primitive["indices"]).reshape(-1, 3), face.triangles)
    assert np.allclose(np.linalg.norm(array(attributes["NORMAL"]), axis=1), 1, atol=1e-4)
    accessor = document["accessors"][attributes["POSITION"]]
    assert np.allclose(accessor["min"], face.vertices.min(axis=0))
    extras = document["meshes"][0]["extras"]
    for name, (first, last) in face.parts.items():
        assert extras["parts"][name]["vertices"] == [first, last]
        a, b = extras["parts"][name]["triangles"]
        assert face.triangles[a:b].min() >= first
        assert face.triangles[a:b].max() < last


def test_to_glb_lets_a_vertex_without_a_triangle_point_forward(face: Face) -> None:
    glb = to_glb(replace(face, triangles=face.triangles[(face.triangles != 0).all(axis=1)]))
    size = struct.unpack_from("<I", glb, 12)[0]
    view = json.loads(glb[20 : 20 + size])["bufferViews"][1]
    assert struct.unpack_from("<3f", glb, 28 + size + view["byteOffset"]) == (0, 0, 1)
