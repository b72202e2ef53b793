"""Tests of the places of the skin in the maps."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.parts import Part, Submesh
from realizer_studio.faces.person.makehuman import BaseMesh, Figure
from realizer_studio.faces.skin.skin_atlas import EYES, HAIR, NEUTRAL, corners, packed

pytestmark = pytest.mark.xdist_group("mask")


def test_corners_puts_left_to_the_right_and_up_to_the_top(figure: Figure, parts: list[Part]) -> None:
    patch = parts[0].patch
    assert patch is not None
    places = corners(figure.mesh, patch)
    middle, face = places.mean(axis=1), parts[0].vertices[patch.triangles].mean(axis=1)
    head = middle[:, 1] < 0.645
    middle, face = middle[head], face[head]
    assert np.corrcoef(middle[:, 0], face[:, 0])[0, 1] > 0.9
    assert np.corrcoef(middle[:, 1], face[:, 1])[0, 1] < -0.9
    assert 0 < places.min() < places.max() < 1


def test_corners_of_a_triangle_across_a_cut_stay_together() -> None:
    # Two quads side by side whose texture coordinates lie far apart.
    at = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0.0]])
    texture = np.array(
        [[0.7, 0.2], [0.7, 0.3], [0.8, 0.3], [0.8, 0.2], [0.7, 0.6], [0.7, 0.7], [0.8, 0.7], [0.8, 0.6]]
    )
    quads = np.array([[0, 1, 2, 3], [1, 4, 5, 2]], np.int32)
    mesh = BaseMesh(at, {"body": quads}, texture, np.array([[0, 1, 2, 3], [4, 5, 6, 7]], np.int32))
    patch = Submesh.of_quads(np.array([[0, 4, 5, 3]], np.int32), 6)
    places = corners(mesh, patch)
    assert np.ptp(places, axis=1).max() < 0.25


def test_regions_do_not_overlap() -> None:
    for one, other in ((NEUTRAL, HAIR), (NEUTRAL, EYES), (HAIR, EYES)):
        apart = one.right <= other.left or other.right <= one.left or one.bottom <= other.top
        assert apart


def test_square_gives_its_rows_and_columns() -> None:
    assert HAIR.texels(64) == (slice(56, 64), slice(56, 64))


def test_packed_fills_16_bits() -> None:
    assert packed([[0, 1.0]]).tolist() == [[0, 65535]]
