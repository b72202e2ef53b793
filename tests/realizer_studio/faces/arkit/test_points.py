"""Tests of finding feature points by form and by shapes."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.basis import unpack
from realizer.face.features import NAMES
from realizer.face.load import folder_of, load_face
from realizer.face.model import Face
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.arkit.points import points_of

pytestmark = pytest.mark.xdist_group("fits")
SHAPES = {
    "eyeBlinkLeft": (19,), "eyeBlinkRight": (20,),
    "mouthUpperUpLeft": (4, 8, 9, 51), "mouthUpperUpRight": (4, 8, 9, 51),
    "mouthLowerDownLeft": (5, 10, 11, 52), "mouthLowerDownRight": (5, 10, 11, 52),
}  # fmt: skip


def unpainted(face: Face) -> tuple[np.ndarray, np.ndarray, tuple[()]]:
    """Return places in textures and materials of a face without either."""
    m = len(face.triangles)
    return np.zeros((m, 3, 2)), np.zeros(m, np.int32), ()


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


def surface_of(face: Face, *names: str) -> Surface:
    """Return ada with shapes, each one centimetre of its FAPs."""
    with np.load(folder_of("ada") / "fields.npz") as file:
        rows = unpack(file, len(face.vertices))
    moves = {name: 0.01 * sum(rows[fap] for fap in SHAPES[name]) for name in names}
    plain = np.zeros(len(face.vertices), np.int32)
    at, colours = face.vertices.astype(float), face.colours.astype(float)
    return Surface(at, face.triangles, colours, plain, (("", "", ""),), moves, *unpainted(face))


def test_points_of_finds_all_points_near_the_marked_ones(face: Face) -> None:
    points, guesses = points_of(surface_of(face, *SHAPES), face.parts)
    assert sorted(points) == sorted(NAMES)
    lips = ("2.2", "2.3", "2.6", "2.7", "2.8", "2.9", "3.1", "3.2", "3.3", "3.4")
    assert not set(lips) & set(guesses)
    for name in lips:
        assert points[name].place == pytest.approx(face.points[name], abs=0.004), name
        assert points[name].place == pytest.approx(face.vertices[points[name].vertex], abs=1e-6)


def test_points_of_trusts_the_form_without_shapes(face: Face) -> None:
    points, _ = points_of(surface_of(face), face.parts)
    for name in ("2.2", "9.3", "3.1"):
        assert points[name].place == pytest.approx(face.points[name], abs=0.004)
