"""Tests of the division of a face at the mouth."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.au.regions import LOWER, UPPER, fit_mouth, halves, skin_roots
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.render.worker import triangle


def test_fit_mouth_puts_feature_points_on_their_own_sides() -> None:
    face = load_face()
    index, upper = halves(face)
    side = dict(zip(index.tolist(), upper.tolist(), strict=True))
    assert all(side[face.feature_points[name]] for name in UPPER)
    assert not any(side[face.feature_points[name]] for name in LOWER)


def test_fit_mouth_separates_the_lips_like_the_topology() -> None:
    face = load_face()
    mouth = fit_mouth(face)
    index, upper = halves(face)
    at = face.vertices[index].astype(np.float64)
    inner = np.abs(at[:, 0]) < mouth.x[-1]
    wrong = (mouth.upper(at) > 0.5) != upper
    assert (wrong & inner).sum() < 0.05 * inner.sum()
    # Those that it gets wrong lie on the line itself.
    assert np.abs(mouth.above(at[wrong & inner])).max() < 0.0015


def test_shares_fade_beyond_the_corners() -> None:
    mouth = fit_mouth(load_face())
    x, y, z = mouth.x[-1] + 0.01, mouth.y[-1], mouth.z[-1]
    steps = np.array([[x, y + d, z] for d in np.linspace(-0.012, 0.012, 25)])
    share = mouth.upper(steps)
    assert share[0] == 0
    assert share[-1] == 1
    assert (np.diff(share) >= 0).all()
    assert np.diff(share).max() < 0.12


def test_fit_mouth_refuses_points_in_the_wrong_order() -> None:
    face = load_face()
    points = dict(face.points)
    points["2.4"], points["2.5"] = points["2.5"], points["2.4"]
    with pytest.raises(FaceError, match=r"further and further left"):
        fit_mouth(replace(face, points=points))


def hairy() -> Face:
    """One triangle of skin, and a hair that stands on its middle and bends over the edge."""
    face, skin = triangle(), [[-0.08, -0.12, 0], [0.08, -0.12, 0], [0, 0.06, 0]]
    hair = [[0.01, -0.06, 0.001], [0.012, -0.06, 0.001], [0.01, -0.06, 0.02], [0.2, -0.06, 0.03]]
    return dataclasses.replace(
        face,
        vertices=np.array(skin + hair, np.float32),
        triangles=np.array([[0, 1, 2], [3, 4, 5], [4, 6, 5]], np.int32),
        parts={"skin": (0, 3), "lashes": (3, 7)},
    )


def test_skin_roots_are_below_and_tips_follow_them() -> None:
    face = hairy()
    corners, share = skin_roots(face, "lashes")
    assert share.sum(axis=1) == pytest.approx(1)
    places = (share[:, :, None] * face.vertices[corners]).sum(axis=1)
    assert places[0] == pytest.approx([0.01, -0.06, 0], abs=1e-6)
    assert places[1] == pytest.approx([0.012, -0.06, 0], abs=1e-6)
    assert places[2] == pytest.approx(places[0], abs=1e-6)
    assert places[3] == pytest.approx(places[1], abs=1e-6)
