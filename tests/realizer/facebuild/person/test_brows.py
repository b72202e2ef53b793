"""Tests of brows and lashes, on shipped faces."""

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer.facebuild.parts import Part
from realizer.facebuild.person.base_mesh import Ground
from realizer.facebuild.person.lids import Lid

FACES = [info.name for info in list_faces() if info.licence == "CC0-1.0"]


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def part(face: Face, name: str, at: np.ndarray) -> np.ndarray:
    return at[slice(*face.parts[name])]


def test_brows_lie_close_on_the_skin(face: Face) -> None:
    from scipy.spatial import cKDTree

    brows = part(face, "brows", face.vertices)
    off, _ = cKDTree(part(face, "skin", face.vertices)).query(brows)
    assert off.max() < 0.008  # as far as the skin's own vertices lie apart
    assert brows[:, 1].min() > face.points["3.1"][1]


def test_brows_rise_with_the_skin(face: Face) -> None:
    row = np.zeros((1, 68), np.float32)
    row[0, 30:36] = 150
    moved = deform(face, row)[0] - face.vertices
    asked = 150 * face.fapu.metres("ENS")
    assert part(face, "brows", moved)[:, 1].mean() == pytest.approx(asked, rel=0.4)


def test_lashes_fall_with_closed_lids(face: Face) -> None:
    row = np.zeros((1, 68), np.float32)
    row[0, 18:20] = 1024
    moved = part(face, "lashes", deform(face, row)[0] - face.vertices)
    rest = part(face, "lashes", face.vertices)
    highest = rest[:, 1] > np.percentile(rest[:, 1], 80)
    assert moved[highest, 1].max() < -0.002


def test_lashes_grow_all_along_the_lids(parts: list[Part], mask_lids: list[Lid], ground: Ground) -> None:
    across = np.concatenate([part.vertices[:, 0] for part in parts if part.name == "lashes"])
    for lid in mask_lids:
        edge = ground.at[lid.upper, 0]
        bins = np.linspace(edge.min(), edge.max(), 6)
        assert np.histogram(across, bins)[0].min() > 5
