"""Tests of strips along strands."""

import numpy as np
import pytest

from realizer.face.mesh_geometry import vertex_normals
from realizer_studio.faces.hair.cards import STRIPS, Patch, hair_texture, joined, ribbons, strip_uv
from realizer_studio.faces.skin.skin_atlas import HAIR


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
    wide = np.abs(np.diff(patch.positions[:, 0].reshape(-1, 2), axis=1))[:, 0]
    assert wide == pytest.approx([0.004] * 5 + [0.001])


def test_ribbons_face_the_way_of_their_normals(patch: Patch) -> None:
    assert (vertex_normals(patch.positions, patch.triangles)[:, 2] > 0.99).all()
    assert (patch.normals[:, 2] > 0.7).all()


def test_ribbons_keep_hairs_straight_where_they_narrow(patch: Patch) -> None:
    u, x = patch.uv[6:, 0].reshape(-1, 2), patch.positions[6:, 0].reshape(-1, 2)
    assert np.diff(u)[:, 0] / np.diff(x)[:, 0] == pytest.approx(np.diff(u)[0, 0] / np.diff(x)[0, 0])


def test_joined_counts_triangles_on(patch: Patch) -> None:
    both = joined([patch, patch])
    count = len(patch.positions)
    assert len(both.positions) == 2 * count
    assert (both.triangles[len(patch.triangles) :] == patch.triangles + count).all()


def test_place_lies_in_its_strip_of_the_corner() -> None:
    (u, v), (right, bottom) = strip_uv("brow", np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    strip = STRIPS["brow"]
    assert (right - u, HAIR.right - u) == pytest.approx(
        ((strip.right - strip.left) * 0.125, (1 - strip.left) * 0.125)
    )
    assert HAIR.top + strip.top * 0.125 < v < bottom < HAIR.top + strip.bottom * 0.125


def cover(picture: np.ndarray, name: str) -> np.ndarray:
    """Return the alpha 0..1 of each row of a strip, from root to tip."""
    strip, size = STRIPS[name], len(picture)
    top, bottom, left, right = (int(s * size) for s in (strip.top, strip.bottom, strip.left, strip.right))
    return np.asarray(picture[top:bottom, left:right, 3].mean(axis=1) / 255)


def test_hair_texture_is_as_dense_as_its_strips_say() -> None:
    picture = hair_texture(256)
    assert picture.shape == (256, 256, 4)
    dense, loose, wisps, sparse = (
        cover(picture, name)[20:60].mean() for name in ("dense", "loose", "wisps", "sparse")
    )
    assert dense > 0.7 > loose > 0.3
    assert wisps > sparse > 0.1


def test_hair_texture_thins_out_to_the_tips() -> None:
    locks = cover(hair_texture(256), "locks")
    assert locks[-1] < 0.1 < locks[200] < locks[120]
