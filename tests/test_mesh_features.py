"""Tests of `tests.mesh_features`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.emotions.archetypes import archetypes
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer_studio.analysis.faps_from_points import facial_features
from realizer_studio.analysis.recognise import recogniser
from tests.mesh_features import (
    faps_from_face,
    faps_from_mesh,
    features_from_mesh,
    measurable_profile,
    points_of,
)

SEEDS = (0, 1, 2)


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


@pytest.mark.parametrize("profiles", ["own", "published"])
def test_faps_from_mesh_recovers_emotions(face: Face, profiles: str) -> None:
    made = [p for numbered in archetypes(profiles).values() for p in numbered.values()]
    frames = np.stack([p.draw(seed) for p in made for seed in SEEDS])
    read, seen = faps_from_mesh(face, deform(face, frames))
    wanted = [p.name.rpartition(" ")[0] for p in made for _ in SEEDS]
    assert recogniser(profiles).names(read, seen) == wanted


def test_faps_from_mesh_recovers_the_faps(face: Face) -> None:
    frames = np.stack([archetypes("own")[name][0].frame() for name in ("joy", "surprise", "anger")])
    read, seen = faps_from_mesh(face, deform(face, frames))
    for asked, got in zip(frames, read, strict=True):
        there = seen & (asked != 0)
        assert np.abs(got - asked)[there].max() < 2


def test_faps_from_face_does_not_depend_on_the_pose_of_the_head(face: Face) -> None:
    joy = archetypes("own")["joy"][0].frame()
    points = points_of(face, deform(face, joy[None]))
    read, seen = faps_from_face(face, {name: at + np.array([0, 0.2, 1]) for name, at in points.items()})
    assert recogniser().names(read, seen) == ["joy"]


def test_faps_from_mesh_refuses_vertices_of_another_face(face: Face) -> None:
    with pytest.raises(ValueError, match=r"vertices: wanted \(n, \d+, 3\), got \(3, 3\)"):
        faps_from_mesh(face, np.zeros((3, 3)))


def test_measurable_profile_holds_what_features_see_of_its_face() -> None:
    face, fear = load_face("ada"), archetypes("published")["fear"][8]
    fitted = measurable_profile(fear, face)
    assert set(fitted.ranges) <= {fap for f in facial_features() for fap in (*f.signs, *f.also)}
    values, _ = features_from_mesh(face, deform(face, fear.frame()[None]))
    assert all(low <= values[0, fap - 1] <= high for fap, (low, high) in fitted.ranges.items())
    assert fitted.ranges[31][0] > 50  # inner brows up
