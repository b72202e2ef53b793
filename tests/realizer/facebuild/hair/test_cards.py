"""Tests of strips along strands."""

import numpy as np
import pytest

from realizer.face.mesh_geometry import vertex_normals
from realizer.facebuild.hair.cards import Patch, joined, ribbons


@pytest.fixture
def patch() -> Patch:
    """Two strips of 10 mm that go up, one of them narrower at the end."""
    places = np.zeros((2, 3, 3))
    places[..., 1] = [0, 0.005, 0.010]
    places[1, :, 0] = 0.02
    ups = np.tile([0, 0, 1.0], (2, 3, 1))
    width = np.array([[0.004, 0.004, 0.004], [0.004, 0.004, 0.001]])
    return ribbons(places, ups, width, ["dense", "locks"], np.full((2, 3), 90.0), np.ones((2, 3)), 0.5)


def test_ribbons_are_as_wide_as_asked(patch: Patch) -> None:
    wide = np.abs(np.diff(patch.places[:, 0].reshape(-1, 2), axis=1))[:, 0]
    assert wide == pytest.approx([0.004] * 5 + [0.001])


def test_ribbons_face_the_way_of_their_normals(patch: Patch) -> None:
    assert (vertex_normals(patch.places, patch.triangles)[:, 2] > 0.99).all()
    assert (patch.ups[:, 2] > 0.7).all()


def test_ribbons_keep_hairs_straight_where_they_narrow(patch: Patch) -> None:
    u, x = patch.uv[6:, 0].reshape(-1, 2), patch.places[6:, 0].reshape(-1, 2)
    assert np.diff(u)[:, 0] / np.diff(x)[:, 0] == pytest.approx(np.diff(u)[0, 0] / np.diff(x)[0, 0])


def test_joined_counts_triangles_on(patch: Patch) -> None:
    both = joined([patch, patch])
    count = len(patch.places)
    assert len(both.places) == 2 * count
    assert (both.triangles[len(patch.triangles) :] == patch.triangles + count).all()
