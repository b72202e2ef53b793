"""Face folders: sound ones load, broken ones say which file and what to change."""

import json
import shutil
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.deform import deform
from realizer.face.features import NAMES
from realizer.face.glb import to_glb
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer.face.surface import face_scale, normals, quantise
from realizer.facebuild.check import check_face

FACES = [info.name for info in list_faces()]


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A face folder to break; its parent is the directory to load it from."""
    source = next(info.path for info in list_faces() if info.name == load_face().name)
    return Path(shutil.copytree(source, tmp_path / "broken"))


def rewrite(path: Path, **arrays: np.ndarray) -> None:
    with np.load(path) as file:
        kept = {name: file[name] for name in file.files}
    np.savez(path, **(kept | arrays))


def faults(copy: Path) -> str:
    return "\n".join(check_face(copy.name, copy.parent))


@pytest.mark.parametrize("name", FACES)
def test_every_face_is_sound_and_says_its_licence(name: str) -> None:
    assert check_face(name) == ()
    info = next(info for info in list_faces() if info.name == name)
    assert info.licence
    assert info.source


def test_the_default_face_has_a_name_of_its_own() -> None:
    assert check_face() == ()
    assert load_face("default") is load_face(load_face().name)


def test_a_directory_comes_before_the_faces_that_came_along(copy: Path) -> None:
    assert load_face("broken", copy.parent).vertices.shape == load_face().vertices.shape
    assert "broken" in [info.name for info in list_faces(copy.parent)]


def test_the_variable_names_a_directory(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REALIZER_FACES", str(copy.parent))
    assert load_face("broken").name == load_face().name


@pytest.mark.parametrize("name", ["nobody", "", "../ada", "a/b"])
def test_an_unknown_face_is_refused_and_the_known_are_listed(name: str) -> None:
    with pytest.raises(FaceError):
        load_face(name)
    assert len(check_face(name)) == 1


@pytest.mark.parametrize("file", ["face.toml", "mesh.npz", "features.csv", "fields.npz"])
def test_a_missing_file_is_named(copy: Path, file: str) -> None:
    (copy / file).unlink()
    assert file in faults(copy)
    with pytest.raises(FaceError, match=file):
        load_face(copy.name, copy.parent)


@pytest.mark.parametrize("file", ["mesh.npz", "fields.npz"])
def test_a_file_of_something_else_is_named(copy: Path, file: str) -> None:
    (copy / file).write_bytes(b"not an archive")
    assert file in faults(copy)


def test_a_feature_point_off_the_mesh_is_named(copy: Path) -> None:
    path = copy / "features.csv"
    lines = path.read_text("utf-8").splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("5.1,"))
    cells = lines[at].split(",")
    lines[at] = ",".join([*cells[:2], "0.3", *cells[3:]])
    path.write_text("\n".join(lines) + "\n", "utf-8")
    assert "5.1" in faults(copy)
    assert "off its vertex" in faults(copy)


def test_a_missing_feature_point_is_named(copy: Path) -> None:
    path = copy / "features.csv"
    path.write_text("\n".join(r for r in path.read_text("utf-8").splitlines() if not r.startswith("4.3,")))
    assert "4.3" in faults(copy)


def test_an_index_out_of_range_is_named(copy: Path) -> None:
    with np.load(copy / "fields.npz") as file:
        vertex = file["vertex"].copy()
    vertex[0] = 10**6
    rewrite(copy / "fields.npz", vertex=vertex)
    assert "fields.npz: vertex" in faults(copy)


def test_nan_vertices_are_named(copy: Path) -> None:
    with np.load(copy / "mesh.npz") as file:
        vertices = file["vertices"].copy()
    vertices[17, 1] = np.nan
    rewrite(copy / "mesh.npz", vertices=vertices)
    assert "not finite, the first is 17" in faults(copy)


def test_holes_in_the_skin_are_named(copy: Path) -> None:
    face = load_face()
    cheek = face.feature_points["5.1"]
    rewrite(copy / "mesh.npz", triangles=face.triangles[(face.triangles != cheek).all(axis=1)])
    assert "holes" in faults(copy)


def test_a_wrong_part_is_named(copy: Path) -> None:
    path = copy / "face.toml"
    path.write_text(path.read_text("utf-8").replace("tongue =", "tung ="), "utf-8")
    assert "'tongue'" in faults(copy)


def test_all_84_feature_points_are_there(face: Face) -> None:
    assert sorted(face.points) == sorted(NAMES)
    assert len(NAMES) == 84


def test_fapu_are_a_persons_distances(face: Face) -> None:
    fapu = face.fapu
    assert 0.007 < fapu.irisd0 < 0.014
    assert 0.050 < fapu.es0 < 0.072
    assert 0.030 < fapu.ens0 < 0.060
    assert 0.010 < fapu.mns0 < 0.030
    assert 0.035 < fapu.mw0 < 0.065


def test_parts_cover_the_mesh_without_overlap(face: Face) -> None:
    ranges = sorted(face.parts.values())
    assert ranges[0][0] == 0
    assert ranges[-1][1] == len(face.vertices)
    assert all(a[1] == b[0] for a, b in pairwise(ranges))


def test_teeth_and_tongue_hide_behind_closed_lips(face: Face) -> None:
    from scipy.spatial import cKDTree

    skin = face.vertices[slice(*face.parts["skin"])]
    front = skin[skin[:, 2] > 0]
    for part in ("upper_teeth", "lower_teeth", "tongue"):
        inside = face.vertices[slice(*face.parts[part])]
        inside = inside[inside[:, 2] > 0]
        near = cKDTree(front[:, :2]).query_ball_point(inside[:, :2], 0.004)
        assert all(front[i, 2].max() > at[2] for i, at in zip(near, inside, strict=True) if i)


def test_the_lips_are_closed_at_rest(face: Face) -> None:
    gap = face.points["2.2"] - face.points["2.3"]
    assert abs(gap[1]) < 0.0005


def test_normals_have_length_one_and_point_outwards(face: Face) -> None:
    ups = normals(face, face.vertices[None])[0]
    assert np.allclose(np.linalg.norm(ups, axis=1), 1, atol=1e-4)
    assert ups[face.feature_points["9.3"], 2] > 0.7
    assert ups[face.feature_points["11.4"], 1] > 0.7


def test_quantised_vertices_come_back_within_a_step(face: Face) -> None:
    rows = np.zeros((3, 68), np.float32)
    rows[1, [47, 48]] = 40000
    rows[2, 2] = 2000
    vertices = deform(face, rows)
    scale, offset = face_scale(face)
    assert scale < 2e-5
    back = quantise(face, vertices).astype(np.float64) * scale + offset
    assert np.abs(back - vertices).max() < scale


def test_the_glb_holds_mesh_colours_and_parts(face: Face) -> None:
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
