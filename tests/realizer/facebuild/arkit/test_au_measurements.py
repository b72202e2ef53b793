"""Tests of measuring action units by an imported head's shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.au.units import units
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.facebuild.arkit.au_measurements import measure_units
from realizer.facebuild.arkit.mesh_merge import Surface

pytestmark = pytest.mark.xdist_group("fits")


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
