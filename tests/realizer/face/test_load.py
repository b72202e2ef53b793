"""Tests of the loader of face folders."""

import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.load import _imported, list_faces, load_face
from realizer.face.model import Face
from realizer_studio.faces.check import check_face
from tests.realizer_studio.faces.arkit.conftest import face_glb

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
def test_list_faces_are_sound_and_have_a_licence(name: str) -> None:
    assert check_face(name) == ()
    info = next(info for info in list_faces() if info.name == name)
    assert info.licence
    assert info.source


def test_list_faces_reports_a_missing_directory(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such folder of faces"):
        list_faces(tmp_path / "none")


def test_load_face_default_has_a_name_of_its_own() -> None:
    assert check_face() == ()
    assert load_face("default") is load_face(load_face().name)


def test_load_face_prefers_a_given_directory(copy: Path) -> None:
    assert load_face("broken", copy.parent).vertices.shape == load_face().vertices.shape
    assert "broken" in [info.name for info in list_faces(copy.parent)]


def test_load_face_reads_the_variable(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REALIZER_FACES", str(copy.parent))
    assert load_face("broken").name == load_face().name


@pytest.mark.parametrize("name", ["nobody", "", ".."])
def test_load_face_lists_the_known_faces_for_an_unknown_one(name: str) -> None:
    with pytest.raises(ValueError, match="face: wanted one of ada, ben"):
        load_face(name)
    assert len(check_face(name)) == 1


@pytest.mark.parametrize("path", ["../ada", "a/b", "mia.glb", Path("here")])
def test_load_face_reports_a_path_where_nothing_is(path: str | Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such face folder or GLB head"):
        load_face(path)
    assert len(check_face(str(path))) == 1


def test_load_face_takes_the_path_of_a_folder(copy: Path) -> None:
    assert load_face(copy).name == load_face(str(copy)).name == load_face().name


def test_load_face_finds_faces_below_the_current_folder(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(copy, tmp_path / "here" / "faces" / "mia")
    monkeypatch.chdir(tmp_path / "here")
    assert "mia" in [info.name for info in list_faces()]


def test_load_face_refuses_a_file_that_is_no_head(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("x")
    with pytest.raises(FaceError, match=r"wanted a face folder, or a head as \.glb"):
        load_face(tmp_path / "x.txt")


def test_load_face_imports_a_head_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    head = tmp_path / "mia.glb"
    head.write_bytes(face_glb(load_face("ada")))
    assert load_face(head).name == "mia"
    (mesh,) = (tmp_path / "cache").rglob("mesh.npz")
    written = mesh.stat().st_mtime_ns
    _imported.cache_clear()
    load_face(str(head))
    assert mesh.stat().st_mtime_ns == written


@pytest.mark.parametrize("file", ["face.toml", "mesh.npz", "features.csv", "fields.npz"])
def test_load_face_names_a_missing_file(copy: Path, file: str) -> None:
    (copy / file).unlink()
    assert file in faults(copy)
    with pytest.raises(FaceError, match=file):
        load_face(copy.name, copy.parent)


@pytest.mark.parametrize("file", ["mesh.npz", "fields.npz"])
def test_load_face_names_a_file_of_another_kind(copy: Path, file: str) -> None:
    (copy / file).write_bytes(b"not an archive")
    assert file in faults(copy)


def test_load_face_names_a_feature_point_off_the_mesh(copy: Path) -> None:
    path = copy / "features.csv"
    lines = path.read_text("utf-8").splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("5.1,"))
    cells = lines[at].split(",")
    lines[at] = ",".join([*cells[:2], "0.3", *cells[3:]])
    path.write_text("\n".join(lines) + "\n", "utf-8")
    assert "5.1" in faults(copy)
    assert "off its vertex" in faults(copy)


def test_load_face_names_a_missing_feature_point(copy: Path) -> None:
    path = copy / "features.csv"
    path.write_text("\n".join(r for r in path.read_text("utf-8").splitlines() if not r.startswith("4.3,")))
    assert "4.3" in faults(copy)


def test_load_face_names_an_index_out_of_range(copy: Path) -> None:
    with np.load(copy / "fields.npz") as file:
        vertex = file["vertex"].copy()
    vertex[0] = 10**6
    rewrite(copy / "fields.npz", vertex=vertex)
    assert "fields.npz: vertex" in faults(copy)


def test_load_face_names_nan_vertices(copy: Path) -> None:
    with np.load(copy / "mesh.npz") as file:
        vertices = file["vertices"].copy()
    vertices[17, 1] = np.nan
    rewrite(copy / "mesh.npz", vertices=vertices)
    assert "not finite, the first is 17" in faults(copy)


def test_check_face_names_holes_in_the_skin(copy: Path) -> None:
    face = load_face()
    cheek = face.feature_points["5.1"]
    rewrite(copy / "mesh.npz", triangles=face.triangles[(face.triangles != cheek).all(axis=1)])
    assert "holes" in faults(copy)


def test_load_face_names_a_wrong_part(copy: Path) -> None:
    path = copy / "face.toml"
    path.write_text(path.read_text("utf-8").replace("tongue =", "tung ="), "utf-8")
    assert "'tung': there is no such part, did you mean tongue?" in faults(copy)


def test_load_face_has_parts_that_cover_the_mesh(face: Face) -> None:
    ranges = sorted(face.parts.values())
    assert ranges[0][0] == 0
    assert ranges[-1][1] == len(face.vertices)
    assert all(a[1] == b[0] for a, b in pairwise(ranges))


def test_load_face_hides_teeth_and_tongue_behind_the_lips(face: Face) -> None:
    from scipy.spatial import cKDTree

    skin = face.vertices[slice(*face.parts["skin"])]
    front = skin[skin[:, 2] > 0]
    for part in ("upper_teeth", "lower_teeth", "tongue"):
        inside = face.vertices[slice(*face.parts[part])]
        inside = inside[inside[:, 2] > 0]
        near = cKDTree(front[:, :2]).query_ball_point(inside[:, :2], 0.004)
        assert all(front[i, 2].max() > at[2] for i, at in zip(near, inside, strict=True) if i)


def test_load_face_has_closed_lips_at_rest(face: Face) -> None:
    gap = face.points["2.2"] - face.points["2.3"]
    assert abs(gap[1]) < 0.0005


def test_load_face_refuses_other_types_and_unknown_deformers() -> None:
    with pytest.raises(TypeError, match="face: wanted the name or the path of a face, got 3"):
        load_face(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="deformer: wanted mpeg4 or au, got 'x'"):
        load_face(deformer="x")
