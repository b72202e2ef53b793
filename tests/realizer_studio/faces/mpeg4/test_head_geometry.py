"""Tests of the landmarks that a head's shape shows."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.load import load_face
from realizer.face.mesh_geometry import grid, vertex_normals
from realizer_studio.faces.mpeg4.head_geometry import HeadGeometry, find_anchors, profile_line
from realizer_studio.faces.mpeg4.point_finder import head_of


def wall(front: np.ndarray) -> HeadGeometry:
    """Return a head whose skin is as far forward as given at 65 heights from -2.2 to 1."""
    heights = np.linspace(-2.2, 1.0, len(front))
    x = np.linspace(-0.5, 0.5, 11)
    at = np.stack([np.tile(x, len(front)), np.repeat(heights, 11), np.repeat(front, 11)], 1)
    triangles = grid(len(front), 11)[:, ::-1]
    eyes = np.array([0.5, 0, 0.0]), np.array([-0.5, 0, 0.0])
    return HeadGeometry(at, triangles, vertex_normals(at, triangles), *eyes, 0.2)


def test_profile_line_follows_the_skin() -> None:
    heights = np.linspace(-2.2, 1.0, 65)
    front = 0.5 + 0.2 * np.sin(3 * heights)
    at, line = profile_line(wall(front))
    assert (np.diff(at) > 0).all()
    assert line == pytest.approx(np.interp(at, heights, front), abs=1e-6)


def test_profile_line_has_no_value_where_there_is_no_skin() -> None:
    head = wall(np.full(65, 0.5))
    half = head.triangles[(head.skin[head.triangles][:, :, 1] > -0.6).all(axis=1)]
    at, line = profile_line(HeadGeometry(head.skin, half, head.normals, head.left, head.right, 0.2))
    assert np.isnan(line[at < -0.7]).all()
    assert np.isfinite(line[at > -0.5]).all()


def test_find_anchors_finds_the_tip_of_the_nose_on_a_profile() -> None:
    heights = np.linspace(-2.2, 1.0, 65)
    nose = 0.5 * np.exp(-(((heights + 0.6) / 0.12) ** 2))
    tip = find_anchors(wall(nose))["tip"]
    assert tip == pytest.approx([0, -0.6, 0.5], abs=0.06)


def test_find_anchors_of_an_even_head_are_mirror_images() -> None:
    face = load_face("ada")
    head, _, unit = head_of(face.vertices, face.triangles, face.parts)
    assert unit == pytest.approx(face.points["3.5"][0] - face.points["3.6"][0], rel=0.02)
    found = find_anchors(head)
    pairs = [name[2:] for name in found if name.startswith("l_")]
    assert {"inner", "outer", "upper", "lower", "corner"} <= set(pairs)
    for name in pairs:
        assert found[f"r_{name}"] == pytest.approx(found[f"l_{name}"] * [-1, 1, 1], abs=0.03), name
    heights = [found[name][1] for name in ("bridge", "tip", "base", "upper", "slit", "lower", "chin")]
    assert heights == sorted(heights, reverse=True)
