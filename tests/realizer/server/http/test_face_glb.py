"""`face_glb`: from the file alone, what is drawn follows the vertices of the mesh stream."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.sparse import csr_matrix

from realizer.face.deform import deform
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.load import list_faces, load_face
from realizer.face.maps import Maps
from realizer.face.model import Face
from realizer.face.surface import normals, quantise
from realizer.server.http.face_glb import KIND_NAMES, face_glb

FACES = [info.name for info in list_faces()]
TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Glb:
    """A file, read as its specification says."""

    def __init__(self, glb: bytes) -> None:
        size = struct.unpack_from("<I", glb, 12)[0]
        self.json, self._data = json.loads(glb[20 : 20 + size]), glb[28 + size :]
        self.mesh = self.json["meshes"][0]
        self.extras = self.mesh["extras"]

    def bytes_at(self, view: int) -> bytes:
        found = self.json["bufferViews"][view]
        return self._data[found["byteOffset"] :][: found["byteLength"]]

    def array(self, number: int) -> np.ndarray:
        accessor = self.json["accessors"][number]
        raw = np.frombuffer(self.bytes_at(accessor["bufferView"]), TYPES[accessor["componentType"]])
        return raw.reshape(accessor["count"], -1).squeeze()

    def attribute(self, name: str) -> np.ndarray:
        return self.array(self.mesh["primitives"][0]["attributes"][name])

    def matrix(self, prefix: str = "") -> csr_matrix:
        rows, columns, weights = (
            self.array(self.extras[prefix + name]) for name in ("rows", "columns", "weights")
        )
        return csr_matrix((weights, columns, rows), (len(rows) - 1, self.extras["vertices"]))

    def picture(self, texture: int) -> Image.Image:
        source = self.json["textures"][texture]["extensions"]["EXT_texture_webp"]["source"]
        return Image.open(io.BytesIO(self.bytes_at(self.json["images"][source]["bufferView"])))


@pytest.fixture(scope="module", params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


@pytest.fixture(scope="module")
def glb(face: Face) -> Glb:
    return Glb(face_glb(face))


def test_face_glb_makes_drawn_vertices_of_streamed_ones(face: Face, glb: Glb) -> None:
    poses = np.zeros((2, len(face.inputs)), np.float32)
    poses[1] = np.random.default_rng(1).uniform(-100, 100, len(face.inputs))
    for vertices in deform(face, poses):
        streamed = quantise(face, vertices[None])[0] * np.float32(glb.extras["scale"])
        streamed += np.float32(glb.extras["offset"])
        ups = normals(face, vertices[None])[0]
        wanted, wanted_ups = drawn_mesh(face)(vertices, ups, np.zeros(len(ups), np.float32))
        assert np.abs(glb.matrix() @ streamed - wanted).max() < 5e-5
        turned = glb.matrix("normal_") @ ups
        turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-20)
        assert np.abs(turned - wanted_ups[:, :3]).max() < 1e-5
    assert np.abs(glb.matrix() @ face.vertices - glb.attribute("POSITION")).max() < 1e-6


def test_face_glb_has_a_primitive_for_each_kind_of_surface(face: Face, glb: Glb) -> None:
    mesh = drawn_mesh(face)
    drawn = []
    for primitive in glb.mesh["primitives"]:
        material = glb.json["materials"][primitive["material"]]
        triangles = glb.array(primitive["indices"]).reshape(-1, 3)
        assert (mesh.kind[triangles] == material["extras"]["kind"]).all()
        assert material["name"].startswith(KIND_NAMES[material["extras"]["kind"]])
        drawn.append(triangles)
    joined = np.concatenate(drawn)
    assert np.array_equal(joined[np.lexsort(joined.T)], mesh.triangles[np.lexsort(mesh.triangles.T)])
    assert {name: tuple(part["vertices"]) for name, part in glb.extras["parts"].items()} == mesh.parts
    assert np.array_equal(glb.attribute("_ROUGHNESS"), mesh.roughness)
    assert np.abs(np.linalg.norm(glb.attribute("NORMAL"), axis=1) - 1).max() < 1e-4


def webp(*colour: int) -> bytes:
    stream = io.BytesIO()
    Image.new({1: "L", 3: "RGB", 4: "RGBA"}[len(colour)], (8, 8), colour).save(stream, "webp", lossless=True)
    return stream.getvalue()


def test_face_glb_has_maps_as_textures_and_folds() -> None:
    face = load_face(FACES[0])
    files = {
        "albedo": webp(9, 99, 199, 255), "relief": webp(128), "surface": webp(1, 2, 3), "folds": webp(128),
    }  # fmt: skip
    count = len(face.triangles)
    uv = np.float32([[0, 0], [1, 0], [0, 1]]) * np.linspace(0.1, 0.9, count, dtype=np.float32)[:, None, None]
    weights = np.linspace(0, 1, len(face.vertices), dtype=np.float32)[:, None]
    maps = Maps(files, uv, 0.001, 0.0002, np.arange(count) == 0, weights, ("frown_left",))
    glb = Glb(face_glb(replace(face, maps=maps, cards=None)))
    skin = next(material for material in glb.json["materials"] if material["name"] == "skin")
    look = skin["pbrMetallicRoughness"]
    assert glb.picture(look["baseColorTexture"]["index"]).convert("RGB").getpixel((4, 4)) == (9, 99, 199)
    assert glb.picture(look["metallicRoughnessTexture"]["index"]).getpixel((4, 4)) == (1, 2, 3)
    assert glb.picture(skin["normalTexture"]["index"]).getpixel((4, 4)) == (128, 128, 255)
    assert look["metallicFactor"] == 0
    (holes,) = [material for material in glb.json["materials"] if material.get("alphaMode") == "MASK"]
    assert holes["name"].endswith("_cards")
    tangents = glb.attribute("TANGENT")
    assert np.abs(np.linalg.norm(tangents[:, :3], axis=1) - 1).max() < 1e-4
    assert np.abs((tangents[:, :3] * glb.attribute("NORMAL")).sum(axis=1)).max() < 1e-4
    folds = glb.extras["folds"]
    assert glb.picture(folds["texture"]).getpixel((4, 4)) == (128, 128, 128)
    assert folds["slope"] == glb.extras["relief"]["slope"] == pytest.approx(0.001 / (0.0002 * 2048))
    assert glb.array(folds["weights"]) / 255 == pytest.approx(weights[:, 0], abs=1 / 255)
    assert len(folds["drives"]) == 1


def test_face_glb_lets_a_vertex_without_a_triangle_point_forward() -> None:
    face = load_face(FACES[0])
    rest = face.triangles[(face.triangles != 0).all(axis=1)]
    glb = Glb(face_glb(replace(face, triangles=rest, maps=None, cards=None)))
    assert np.abs(np.linalg.norm(glb.attribute("NORMAL"), axis=1) - 1).max() < 1e-4
