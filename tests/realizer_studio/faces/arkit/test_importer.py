"""Tests of the import of a GLB head, mostly of a shipped face with ARKit's shapes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import FaceError
from realizer.face.au.units import units
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.tables import Fap, faps
from realizer_studio.faces.arkit.importer import Report, import_head, inspect_head, measure_units
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.au.measure import read_shapes
from realizer_studio.faces.check import check_face
from tests.realizer_studio.faces.arkit.test_gltf import split, written
from tests.rows import each_row

pytestmark = pytest.mark.xdist_group("fits")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where imported faces are."""
    return tmp_path_factory.mktemp("faces")


@pytest.fixture(scope="module")
def brought(ada_glb: Path, place: Path) -> tuple[Face, Report]:
    report = import_head(ada_glb, place / "again")
    assert check_face("again", place) == ()
    return load_face("again", place), report


def test_import_head_keeps_size_and_parts(brought: tuple[Face, Report]) -> None:
    face, report = brought
    first = load_face("ada")
    assert set(face.parts) == set(first.parts) - {"tears"}  # what lies before eyes is left out
    for unit in ("es0", "ens0", "mns0", "mw0", "irisd0"):
        assert getattr(face.fapu, unit) == pytest.approx(getattr(first.fapu, unit), rel=0.05)
    assert any("in metres" in line for line in report.found)
    assert report.missing == ()


def test_import_head_measures_action_units(brought: tuple[Face, Report], place: Path) -> None:
    measured = read_shapes(place / "again" / "au_shapes.npz")
    assert {1, 2, 4, 5, 6, 9, 12, 15, 16, 17, 20, 26, 43} <= set(measured)
    assert all(one.moves.any() and (one.at[:, 0] > -1e-6).all() for one in measured.values())
    assert brought[1].found[-1].startswith(f"{len(measured)} action units")


def with_picture(source: Path, path: Path) -> Path:
    """Write the head with a picture beside it on all that its first material paints."""
    document, data = split(source)
    document["images"], document["textures"] = [{"uri": "skin.png"}], [{"source": 0}]
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    (primitive,) = document["meshes"][0]["primitives"]
    count = document["accessors"][primitive["attributes"]["POSITION"]]["count"]
    document["accessors"].append({"componentType": 5126, "count": count, "type": "VEC2"})
    primitive["attributes"]["TEXCOORD_0"] = len(document["accessors"]) - 1
    Image.new("RGB", (5, 7), (200, 150, 120)).save(path.parent / "skin.png")
    return written(path, document, data)


def test_import_head_writes_maps_or_nothing(ada_glb: Path, tmp_path: Path) -> None:
    source = with_picture(ada_glb, tmp_path / "head.glb")
    import_head(source, tmp_path / "mia")
    assert check_face("mia", tmp_path) == ()
    maps = load_face("mia", tmp_path).maps
    assert maps is not None
    assert maps.files.keys() == {"albedo"}
    before = {path.name: path.read_bytes() for path in (tmp_path / "mia").iterdir()}
    (tmp_path / "skin.png").unlink()
    for folder in ("mia", "new"):
        with pytest.raises(FaceError, match=r"skin\.png"):
            import_head(source, tmp_path / folder)
    assert {path.name: path.read_bytes() for path in (tmp_path / "mia").iterdir()} == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["head.glb", "mia"]
    with pytest.raises(FaceError, match=r"skin\.png"):
        inspect_head(source)


@pytest.mark.slow
def test_import_head_removes_the_maps_of_an_import_before(ada_glb: Path, tmp_path: Path) -> None:
    (tmp_path / "normal.webp").write_bytes(b"old")
    (tmp_path / "notes.txt").write_text("mine", "utf-8")
    import_head(ada_glb, tmp_path, "again")
    assert not (tmp_path / "normal.webp").exists()
    assert (tmp_path / "notes.txt").is_file()


@pytest.mark.parametrize("value", [-250, 300])
def test_import_head_stretches_corners_without_folds(brought: tuple[Face, Report], value: float) -> None:
    face, _ = brought
    asked = np.zeros((2, 68), np.float32)
    asked[1, [5, 6, 52, 53]] = value
    first, last = face.parts["skin"]
    rest, moved = deform(face, asked)
    a, b, c = np.moveaxis(rest[triangles := face.triangles[(face.triangles < last).all(axis=1)]], 1, 0)
    front = np.cross(b - a, c - a)[:, 2] / 2
    a, b, c = np.moveaxis(moved[triangles], 1, 0)
    away = np.abs(rest[triangles].mean(axis=1) - face.points["2.2"])
    cheek = (away < (0.06, 0.03, 0.03)).all(axis=1) & (front > 0.4e-6)
    assert first == 0
    assert (np.cross(b - a, c - a)[cheek, 2] <= 0).mean() < 0.005


LINEAR = [row for row in faps()[2:] if row.direction in ("up", "down", "left", "right")]


@each_row("row", [row for row in LINEAR if row.unit != "angle_unit"])
def test_import_head_keeps_the_movement_of_every_point(brought: tuple[Face, Report], row: Fap) -> None:
    asked = np.zeros((1, 68), np.float32)
    asked[0, row.fap - 1] = 150
    axis = 1 if row.direction in ("up", "down") else 0
    again, before = (
        (deform(face, asked)[0] - face.vertices)[face.feature_points[row.feature_point], axis]
        for face in (brought[0], load_face("ada"))
    )
    assert again == pytest.approx(before, rel=0.05)


def egg_with_painted_eyes(new_glb: type) -> bytes:
    """An egg whose mouth and eyes are part of its skin, with seven shapes; no part has a telling name."""
    rows, columns = 90, 120
    polar = np.linspace(0.01, np.pi - 0.01, rows)[:, None]
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None]
    at = np.stack(
        [
            0.075 * np.sin(polar) * np.sin(turn),
            0.11 * np.cos(polar) + 0 * turn,
            0.09 * np.sin(polar) * np.cos(turn),
        ],
        -1,
    ).reshape(-1, 3)
    front = at[:, 2] > 0
    blob = lambda x, y, r: front * np.exp(-(((at[:, 0] - x) / r) ** 2) - ((at[:, 1] - y) / r) ** 2)  # noqa: E731
    at[:, 2] += 0.02 * blob(0, -0.012, 0.012) + 0.006 * blob(0, -0.045, 0.012)
    moves = {
        "jawOpen": -0.02 * blob(0, -0.075, 0.03)[:, None] * [0, 1, 0.3],
        "mouthSmileLeft": 0.01 * blob(0.022, -0.045, 0.012)[:, None] * [1, 1, 0],
        "mouthSmileRight": 0.01 * blob(-0.022, -0.045, 0.012)[:, None] * [-1, 1, 0],
        "eyeBlinkLeft": -0.01 * blob(0.03, 0.028, 0.009)[:, None] * [0, 1, 0],
        "eyeBlinkRight": -0.01 * blob(-0.03, 0.028, 0.009)[:, None] * [0, 1, 0],
        "eyeLookOutLeft": 0.004 * blob(0.03, 0.02, 0.006)[:, None] * [1, 0, 0],
        "eyeLookOutRight": 0.004 * blob(-0.03, 0.02, 0.006)[:, None] * [-1, 0, 0],
    }
    glb = new_glb()
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = (r * columns + c).ravel(), (r * columns + (c + 1) % columns).ravel()
    triangles = np.concatenate([np.stack([a, a + columns, b], 1), np.stack([b, a + columns, b + columns], 1)])
    glb.mesh("Object_1", at, triangles, np.full(at.shape, 200), moves)
    return bytes(glb.bytes())


@pytest.mark.slow
def test_import_head_takes_few_shapes_and_painted_eyes(new_glb: type, tmp_path: Path) -> None:
    path = tmp_path / "egg.glb"
    path.write_bytes(egg_with_painted_eyes(new_glb))
    report = import_head(path, tmp_path / "egg")
    assert any("the eyes are no balls" in line for line in report.found)
    assert any(line.startswith("tongue") for line in report.missing)
    face = load_face("egg", tmp_path)
    row = np.zeros((2, 68), np.float32)
    row[:, 22] = 0, 20000
    rest, looking = deform(face, row)
    moved = looking - rest
    assert moved[:, 0].max() > 0.001
    # By its shape: as far as the shape reaches, and the rest of the head stays.
    assert np.abs(moved[face.vertices[:, 0] < 0]).max() < 1e-6


def unpainted(face: Face) -> tuple[np.ndarray, np.ndarray, tuple[()]]:
    """Return places in textures and materials of a face without either."""
    m = len(face.triangles)
    return np.zeros((m, 3, 2)), np.zeros(m, np.int32), ()


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


def surface_of(face: Face, **moves: np.ndarray) -> Surface:
    n = len(face.vertices)
    at = face.vertices.astype(float)
    plain = np.zeros(n, np.int32)
    return Surface(at, face.triangles, np.zeros((n, 3)), plain, (("", "", ""),), moves, *unpainted(face))


def test_measure_units_needs_every_shape_of_a_unit(face: Face) -> None:
    up = np.tile([0, 0.01, 0.0], (len(face.vertices), 1))
    assert measure_units(face, surface_of(face)) == {}
    measured = measure_units(face, surface_of(face, browInnerUp=up))
    served = {au for au, unit in units().items() if set(unit.mixture) == {"browInnerUp"}}
    assert set(measured) == served
    assert 1 in measured


def test_measure_units_weighs_the_shapes_of_both_sides(face: Face) -> None:
    rng = np.random.default_rng(4)
    moves = {f"mouthSmile{side}": rng.normal(size=face.vertices.shape) for side in ("Left", "Right")}
    one = measure_units(face, surface_of(face, **moves))[12]
    double = measure_units(face, surface_of(face, **{name: 2 * move for name, move in moves.items()}))[12]
    assert np.allclose(double.moves, 2 * one.moves)
    skin = slice(*face.parts["skin"])
    half = face.vertices[skin][:, 0] > -1e-6
    weight = units()[12].mixture["mouthSmile"]
    assert np.allclose(one.moves, weight * sum(moves.values())[skin][half])


def test_measure_units_takes_the_left_half_and_marks_hidden_places(face: Face) -> None:
    up = np.tile([0, 0.01, 0.0], (len(face.vertices), 1))
    dark = replace(face, occlusion=np.zeros_like(face.occlusion))
    lit = replace(face, occlusion=np.ones_like(face.occlusion))
    for shaded, seen in ((dark, False), (lit, True)):
        one = measure_units(shaded, surface_of(face, browInnerUp=up))[1]
        assert (one.visible == seen).all()
        assert (one.at[:, 0] > -1e-5).all()
        assert one.upper is not None
        assert len(one.at) == len(one.moves) == len(one.upper)
