"""Tests of the successive mixer of a whole face."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.au.model import Model
from realizer.face.au.regions import attached_parts, shares, skin
from realizer.face.au.successive_mixer import SuccessiveMixer
from realizer.face.load import load_face
from realizer.face.model import Face
from tests.au_mixers import successive
from tests.shipped import FACES


@pytest.fixture(scope="module", params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param, deformer="au")


def model(face: Face) -> Model:
    assert face.model is not None
    return face.model


@pytest.mark.parametrize("order", [(12, 25), (25, 12), (1, 4, 7), (20, 1, 25, 5)])
def test_succession_equals_the_reference_mixer(face: Face, order: tuple[int, ...]) -> None:
    made = SuccessiveMixer(face, model(face))(dict.fromkeys(order, (0.8, 0.8)))
    mine, at = skin(face), face.vertices.astype(np.float64)
    upper = shares(face, model(face).mouth)[mine]
    wanted = successive(model(face), at[mine], dict.fromkeys(order, 0.8), upper) - at[mine]
    # What a unit moves by less than 0.01 mm is left out, as in the sum. Where lips meet, either may have a
    # vertex.
    apart = np.abs(made[mine] - wanted).max(axis=1)
    assert np.mean(apart > 1e-5 * len(order) * 2) < 0.001
    assert apart.max() < 0.0007


def test_succession_moves_only_what_units_move(face: Face) -> None:
    made = SuccessiveMixer(face, model(face))({12: (1, 1), 27: (1, 1)})
    for part in ("left_eye", "upper_teeth", "lower_teeth", "tongue", "shirt"):
        if part in face.parts:
            assert not made[slice(*face.parts[part])].any(), part


def test_succession_moves_brows_and_lashes_with_the_skin(face: Face) -> None:
    # Shipped faces have cards for hairs: their shirt stands for brows that are part of a mesh.
    face = replace(face, parts={"skin": face.parts["skin"], "brows": face.parts["shirt"]})
    made = SuccessiveMixer(face, model(face))({4: (1, 1), 1: (1, 1), 12: (1, 1)})
    parts = attached_parts(face)
    assert len(parts) == 1
    for first, last, corners, share in parts:
        assert made[first:last] == pytest.approx(np.einsum("nk,nkc->nc", share, made[corners]))


def test_succession_of_one_side_leaves_the_other(face: Face) -> None:
    made = SuccessiveMixer(face, model(face))({6: (1, 0), 12: (1, 0)})
    left, right = (face.feature_points[point] for point in ("8.3", "8.4"))
    assert np.linalg.norm(made[left]) > 0.004
    assert np.linalg.norm(made[right]) < 1e-5


def test_succession_of_all_units_stays_near_the_face(face: Face) -> None:
    """Off the skin, functions were fitted to nothing: there a unit may not move a place by all they say."""
    units = [au for au in sorted(model(face).units) if au not in (25, 26, 43)]
    chain = SuccessiveMixer(face, model(face))
    made = chain(dict.fromkeys(units, (0.5, 0.5)))
    summed = sum(0.5 * chain({au: (1, 1)}) for au in units)
    assert np.linalg.norm(made - summed, axis=1).max() < 0.01


def test_succession_of_nothing_moves_nothing(face: Face) -> None:
    assert not SuccessiveMixer(face, model(face))({}).any()
    assert not SuccessiveMixer(face, model(face))({12: (0, 0)}).any()
