"""Tests of the limits of fitted action units."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from realizer.core.errors import FaceError
from realizer.face.au.file import read_model
from realizer.face.au.model import Model
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer_studio.faces.au.fit_limits import FURTHEST, monitored_points, overshoot, runaways
from realizer_studio.faces.au.measure import UnitMeasurement, read_shapes
from realizer_studio.faces.au.model_file import write_model
from realizer_studio.faces.au.unit_fit import fit_models

pytestmark = pytest.mark.xdist_group("fits")

FITTED = {info.name: info.path for info in list_faces() if (info.path / "au_extended.toml").is_file()}
FOLDER = FITTED[load_face().name]
FORMS = ("published", "extended")
BELL = np.array([[1.5, 0, 0, 0, 1, 0, 1, 0, 0, 1.0]])


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face(deformer="mpeg4")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", FITTED)
def test_runaways_are_none_on_shipped_faces(name: str, form: str) -> None:
    model = read_model(FITTED[name] / f"au_{form}.toml")
    assert runaways(load_face(name), model, read_shapes(FITTED[name] / "au_shapes.npz")) == ()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", FITTED)
def test_furthest_is_limited_between_the_vertices_too(name: str, form: str) -> None:
    """On a mesh of another topology vertices lie between and just off those of this one."""
    face, model = load_face(name), read_model(FITTED[name] / f"au_{form}.toml")
    first, last = face.parts["skin"]
    skin = face.vertices[face.triangles].astype(np.float64)
    skin = skin[((face.triangles >= first) & (face.triangles < last)).all(axis=1)]
    rng = np.random.default_rng(1)
    at = np.einsum("mk,mkc->mc", rng.dirichlet(np.ones(3), len(skin)), skin)
    at += rng.uniform(-0.001, 0.001, at.shape)
    for au, one in read_shapes(FITTED[name] / "au_shapes.npz").items():
        d_max = np.linalg.norm(one.moves[one.visible], axis=1).max()
        far = np.linalg.norm(model.displacement(au, at), axis=1).max()
        assert far < 2 * d_max, f"AU{au}"


@pytest.mark.slow
def test_fit_models_limits_places_without_landmarks(face: Face) -> None:
    """A few landmarks in a row leave all else open; no vertex takes more than is allowed all the same."""
    x = np.linspace(0.005, 0.03, 8)
    at = np.stack([x, np.full(8, -0.055), np.full(8, 0.02)], axis=1)
    moves = np.stack([0 * x, 0.5 * x, 0.2 * x], axis=1)
    measured = {12: UnitMeasurement(12, at, moves, np.ones(8, bool))}
    for model in fit_models(face, measured).values():
        assert runaways(face, model, measured) == ()


def test_runaways_name_unit_and_place(face: Face) -> None:
    model, measured = read_model(FOLDER / "au_published.toml"), read_shapes(FOLDER / "au_shapes.npz")
    (found,) = runaways(face, torn(model), measured)
    assert found.startswith("AU1 moves the place ")
    assert "nothing was measured to move more than" in found


def test_overshoot_costs_only_what_is_too_far() -> None:
    miss, slopes = overshoot(BELL, np.array([[0, 0, 0], [3.0, 0, 0]]))
    assert miss.shape == (1,)
    assert slopes.shape == (1, 10)
    assert miss[0] > 0
    assert not len(overshoot(BELL * np.r_[0.7, np.ones(9)], np.zeros((1, 3)))[0])
    # Either way, and by the same slope that a step of the parameters shows.
    for sign in (1, -1):
        bell = BELL * np.r_[sign, np.ones(9)]
        miss, slopes = overshoot(bell, np.full((1, 3), 0.2))
        for column in range(10):
            step = np.zeros((1, 10))
            step[0, column] = 1e-6
            more = overshoot(bell + step, np.full((1, 3), 0.2))[0]
            assert (more - miss)[0] / 1e-6 == pytest.approx(slopes[0, column], abs=1e-3)


def test_monitored_points_are_each_vertex_once_on_the_left(face: Face) -> None:
    model = read_model(FOLDER / "au_published.toml")
    places = monitored_points(face, model.mouth)
    assert (places.at[:, 0] >= 0).all()
    assert 1000 < len(places.at) < len(face.vertices)
    corner = np.linalg.norm(places.at - face.points["8.3"], axis=1)
    assert corner.min() < 1e-6
    finer = monitored_points(face, model.mouth, between=True)
    assert len(finer.at) > 3 * len(places.at)
    assert {tuple(at) for at in places.at.tolist()} <= {tuple(at) for at in finer.at.tolist()}
    # Every place belongs to a half, or in part to both.
    assert len(places.of("upper")) + len(places.of("lower")) >= len(places.of("whole")) == len(places.at)


def test_fit_command_writes_no_model_that_tears_the_face(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from realizer_studio.cli.fit_face import fit_face

    model = torn(read_model(FOLDER / "au_published.toml"))
    monkeypatch.setattr("realizer_studio.faces.au.unit_fit.fit_models", lambda *_: {"published": model})
    done = CliRunner().invoke(fit_face, ["default", "--form", "published", "-o", str(tmp_path)])
    assert isinstance(done.exception, FaceError)
    assert "nothing written" in str(done.exception)
    assert "published: AU1 moves the place" in str(done.exception)
    assert not list(tmp_path.iterdir())


def torn(model: Model) -> Model:
    """The model with a far too high Gaussian in AU1."""
    unit = model.units[1]
    high = unit.motions["whole"].gaussians * np.r_[3.0, np.ones(9)]
    motions = {"whole": replace(unit.motions["whole"], gaussians=high)}
    return replace(model, units={**model.units, 1: replace(unit, motions=motions)})


def test_runaways_are_found_in_a_model_from_a_file(face: Face, tmp_path: Path) -> None:
    """What is held is the fit, not the reading: a model that was edited by hand is taken as it is."""
    write_model(tmp_path / "torn.toml", torn(read_model(FOLDER / "au_published.toml")))
    measured = read_shapes(FOLDER / "au_shapes.npz")
    assert len(runaways(face, read_model(tmp_path / "torn.toml"), measured)) == 1
    assert FURTHEST > 1
