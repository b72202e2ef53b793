"""Tests of the builder of a face folder from a recipe."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.deform import deform
from realizer.face.load import load_face
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
