"""Tests of the builder of a face folder from a recipe."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import FaceError
from realizer.face.deform import deform
from realizer.face.load import folder_of, load_face
from realizer.face.model import Face
from realizer_studio.faces.parts import Part
from realizer_studio.faces.person import person_build as build
from realizer_studio.faces.person.bust import ORDER
from realizer_studio.faces.person.makehuman import OBJ
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.skin.maps import SkinMaps

pytestmark = pytest.mark.xdist_group("mask")
SAYS = 'A mask, "coarse" and calm'


@pytest.fixture(scope="module")
def written(
    person: Person,
    parts: list[Part],
    fields: dict[int, np.ndarray],
    maps: SkinMaps,
    tmp_path_factory: pytest.TempPathFactory,
) -> Face:
    folder = tmp_path_factory.mktemp("faces") / "mask"
    folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "without_flips", lambda fields, *_: dict(fields))
        build.write_face(folder, "mask", SAYS, person, parts, fields, maps)
    return load_face("mask", folder.parent)


def test_write_face_keeps_vertices_and_parts(written: Face, parts: list[Part]) -> None:
    assert list(written.parts) == [name for name in ORDER if name != "glasses"]
    assert len(written.vertices) == sum(len(part.vertices) for part in parts)
    assert np.allclose(written.vertices[: len(parts[0].vertices)], parts[0].vertices, atol=1e-6)
    assert written.name == "mask"


def test_write_face_writes_maps_and_a_white_skin(written: Face, parts: list[Part]) -> None:
    n = len(parts[0].vertices)
    assert (written.colours[:n] == 255).all()
    assert written.maps is not None
    assert set(written.maps.files) == {"albedo", "relief", "surface", "folds"}
    assert written.maps.folds[:n].max() > 0.9
    assert not written.maps.folds[n:].any()


def test_write_face_puts_feature_points_on_their_vertices(written: Face, person: Person) -> None:
    for name in ("2.1", "2.2", "8.3", "3.1"):
        assert written.points[name] == pytest.approx(person.figure.point(name), abs=1e-5)
        assert written.vertices[written.feature_points[name]] == pytest.approx(written.points[name], abs=1e-5)
    assert written.points["7.1"] == pytest.approx(person.head_pivot)
    assert written.points["9.8"][1] > written.points["9.10"][1]


def test_write_face_makes_a_face_that_obeys_faps(written: Face) -> None:
    row = np.zeros((1, 68), np.float32)
    row[0, 30] = 100
    moved = deform(written, row)[0] - written.vertices
    asked = 100 * written.fapu.metres("ENS")
    assert moved[written.feature_points["4.1"], 1] == pytest.approx(asked, rel=0.01)


def test_write_face_hangs_the_lower_teeth_on_the_jaw(written: Face) -> None:
    row = np.zeros((1, 68), np.float32)
    row[0, 2] = 300
    moved = deform(written, row)[0] - written.vertices
    assert moved[slice(*written.parts["lower_teeth"]), 1].max() < -0.002
    assert not moved[slice(*written.parts["upper_teeth"])].any()


def test_build_face_names_missing_data_and_recipes(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match="wanted the unpacked wheel"):
        build.build_face("x", tmp_path, tmp_path / "x")
    (tmp_path / OBJ).parent.mkdir(parents=True)
    (tmp_path / OBJ).touch()
    with pytest.raises(FaceError, match=r"recipe\.toml: wanted a recipe"):
        build.build_face("x", tmp_path, tmp_path / "x")


def fields_of(folder: Path) -> dict[int, np.ndarray]:
    """Return each row of `fields.npz` as (n, 3)."""
    with np.load(folder / "fields.npz") as stored:
        rows = np.zeros((len(stored["row"]), len(stored["head"]), 3))
        of_row = np.repeat(np.arange(len(rows)), np.diff(stored["start"]))
        rows[of_row, stored["vertex"]] = stored["move"]
        return dict(zip(stored["row"].tolist(), rows, strict=True))


@pytest.mark.slow
@pytest.mark.skipif("REALIZER_HEAD_DATA" not in os.environ, reason="wants the unpacked CC0 head data")
@pytest.mark.parametrize("person", ["ada", "ida"])
def test_build_face_makes_the_face_that_ships(person: str, tmp_path: Path) -> None:
    """Processors differ in the last digits: a thousandth of a move, or one of 255 levels, may be another."""
    shipped, built = folder_of(person), tmp_path / person
    built.mkdir()
    shutil.copy(shipped / build.RECIPE, built)
    build.build_face(person, Path(os.environ["REALIZER_HEAD_DATA"]), built, lambda _: None)
    for name in ("mesh.npz", "cards.npz"):
        with np.load(shipped / name) as wanted, np.load(built / name) as made:
            assert made.files == wanted.files
            for array in wanted.files:
                least = 2 if wanted[array].dtype == np.uint8 else 1e-5
                assert made[array] == pytest.approx(wanted[array], abs=least), array
    wanted_fields, made_fields = fields_of(shipped), fields_of(built)
    assert made_fields.keys() == wanted_fields.keys()
    for number, field in wanted_fields.items():
        assert np.abs(made_fields[number] - field).max() < 1e-3, number
    for name in ("albedo", "relief", "surface", "folds"):
        wanted_map, made_map = (
            np.asarray(Image.open(folder / f"{name}.webp"), float) for folder in (shipped, built)
        )
        assert np.abs(made_map - wanted_map).mean() < 0.1, name
    for name in ("features.csv", "face.toml"):
        assert (built / name).read_text("utf-8") == (shipped / name).read_text("utf-8")
