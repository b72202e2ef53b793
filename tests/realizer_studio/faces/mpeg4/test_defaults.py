"""Tests of the default zones of a head."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles
from realizer.face.model import Face
from realizer.tables import faps
from realizer_studio.faces.mpeg4.defaults import default_setup, split_sides
from realizer_studio.faces.mpeg4.zones import Setup

Points = dict[str, tuple[float, float, float]]


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


@pytest.fixture(scope="module")
def points(face: Face) -> Points:
    return {name: tuple(place.tolist()) for name, place in face.points.items()}


@pytest.fixture(scope="module")
def setup(face: Face, points: Points) -> Setup:
    return default_setup(face.vertices, face.triangles, points, face.parts["skin"])


def test_default_setup_mirrors_the_zones_of_two_sides(setup: Setup) -> None:
    for fap, zone in setup.zones.items():
        twin = faps()[fap - 1].mirror
        assert setup.zones[twin].radii == pytest.approx(zone.radii)
        assert (fap in setup.synced) == (twin != fap)
        if twin > fap:
            assert setup.zones[twin] == zone.mirrored(twin)


def test_default_setup_has_a_mask_for_each_zone_that_uses_one(face: Face, setup: Setup) -> None:
    assert {fap for fap, zone in setup.zones.items() if zone.use_mask} <= set(setup.masks)
    first, last = face.parts["skin"]
    for mask in setup.masks.values():
        assert first <= mask.min()
        assert mask.max() < last


def test_default_setup_grows_with_the_head(face: Face, points: Points, setup: Setup) -> None:
    large = {name: tuple(2 * x for x in place) for name, place in points.items()}
    double = default_setup(2 * face.vertices, face.triangles, large, face.parts["skin"])  # type: ignore[arg-type]
    for fap, zone in setup.zones.items():
        assert double.zones[fap].size == pytest.approx(2 * zone.size, rel=1e-6)


def test_default_setup_names_a_missing_point(face: Face, points: Points) -> None:
    fewer = {name: place for name, place in points.items() if name != "8.1"}
    with pytest.raises(FaceError, match=r"feature point 8\.1 is missing"):
        default_setup(face.vertices, face.triangles, fewer, face.parts["skin"])


def test_split_sides_parts_the_skin_in_two(face: Face, points: Points) -> None:
    skin = face.parts["skin"]
    sides = split_sides(face.vertices.astype(float), face.triangles, points, skin)
    for upper in ("upper_lip", "upper_lid_left", "upper_lid_right"):
        above, below = sides[upper], sides[upper.replace("upper", "lower")]
        assert sorted([*above.tolist(), *below.tolist()]) == list(range(*skin))
    for name, upper in (("2.2", "upper_lip"), ("3.1", "upper_lid_left"), ("3.2", "upper_lid_right")):
        assert np.isin(face.feature_points[name], sides[upper])
    for name, lower in (("2.3", "lower_lip"), ("3.3", "lower_lid_left"), ("3.4", "lower_lid_right")):
        assert np.isin(face.feature_points[name], sides[lower])


@pytest.mark.parametrize("first", [0, 7])
def test_split_sides_joins_vertices_at_one_place(face: Face, points: Points, first: int) -> None:
    """A skin whose triangles share no vertices is parted as one whose triangles do."""
    begin, end = face.parts["skin"]
    own = part_triangles(face.triangles, (begin, end)).ravel()
    torn = np.concatenate([np.zeros((first, 3)), face.vertices[begin:end][own]])
    loose = np.arange(first, len(torn), dtype=np.int32).reshape(-1, 3)
    parted = split_sides(torn, loose, points, (first, len(torn)))
    for name, whole in split_sides(face.vertices.astype(float), face.triangles, points, (begin, end)).items():
        got, wanted = np.isin(np.arange(first, len(torn)), parted[name]), np.isin(own + begin, whole)
        assert np.mean(got == wanted) > 0.999, name
