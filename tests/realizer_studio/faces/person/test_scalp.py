"""Tests of the scalp, on the skin of a shipped face."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles
from realizer.face.model import Face
from realizer_studio.faces.person.scalp import Scalp

LINE = [[0, 0.06], [60, 0.05], [90, 0.0], [130, -0.06], [180, -0.07]]


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


@pytest.fixture(scope="module")
def scalp(face: Face) -> Scalp:
    base = face.vertices[slice(*face.parts["skin"])].astype(float)
    mine = part_triangles(face.triangles, face.parts["skin"])
    return Scalp(base, mine, {name: np.array(at, float) for name, at in face.points.items()}, LINE, [[0, 0]])


def test_scalp_degrees_run_from_the_front_to_the_back(scalp: Scalp) -> None:
    around = np.array([[0, 0, 0.1], [0.1, 0, scalp.middle[2]], [-0.1, 0, scalp.middle[2]], [0, 0, -0.3]])
    front, left, right, back = scalp.degrees(around)
    assert front == 0
    assert left == pytest.approx(right)
    assert front < left < back == 180


def test_scalp_high_is_positive_on_the_crown_and_negative_in_the_face(scalp: Scalp, face: Face) -> None:
    places = np.array([face.points[name] for name in ("11.4", "9.3", "2.1")], float)
    crown, nose, chin = scalp.high(places)
    assert crown > 0 > nose > chin


def test_scalp_high_grows_upwards(scalp: Scalp) -> None:
    column = np.stack([np.zeros(9), np.linspace(-0.1, 0.1, 9), np.full(9, 0.05)], 1)
    assert (np.diff(scalp.high(column)) > 0).all()


def test_scalp_ear_distance_is_negative_at_the_ear_alone(scalp: Scalp, face: Face) -> None:
    ear = (face.points["10.1"] + face.points["10.5"]) / 2
    places = np.stack([ear, ear * [0, 1, 1], ear + np.array([0, 0.1, 0])])
    at_ear, inside, above = scalp.ear_distance(places)
    assert at_ear < 0 < above
    assert inside == np.inf


def test_scalp_skull_lies_along_its_ways(scalp: Scalp) -> None:
    ways = np.random.default_rng(3).normal(size=(30, 3)) * [1, 0, 1] + [0, 2, 0]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    off = scalp.skull(ways) - scalp.middle
    assert np.cross(off, ways) == pytest.approx(np.zeros((30, 3)), abs=1e-9)
    assert np.linalg.norm(off, axis=1) == pytest.approx(0.12, abs=0.06)


def test_scalp_lift_is_the_height_above_the_skin(scalp: Scalp) -> None:
    index = np.flatnonzero((scalp.at[:, 1] > 0.05) & (np.abs(scalp.at[:, 0]) < 0.03))[::20]
    lifted = scalp.at[index] + 0.004 * scalp.normals[index]
    height, ups = scalp.lift(lifted)
    assert height == pytest.approx(np.full(len(index), 0.004), abs=0.001)
    assert np.linalg.norm(ups, axis=1) == pytest.approx(np.ones(len(index)))
    assert scalp.distance(scalp.at[index]) == pytest.approx(np.zeros(len(index)))
