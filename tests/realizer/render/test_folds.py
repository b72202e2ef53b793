"""`Folds`: the folds of expressions show where the skin is pushed together."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.maps import Maps
from realizer.render.folds import Folds
from realizer.tables import by_number
from tests.shipped import FACES

REGIONS = ("frown_left", "frown_right", "inner_left", "nowhere_left")


@pytest.fixture(scope="module")
def face():
    plain = load_face("ada")
    weights = np.zeros((len(plain.vertices), len(REGIONS)), np.float32)
    weights[:4] = np.eye(4)
    return replace(plain, maps=Maps({}, np.zeros(0), 0.0, 1.0, np.zeros(0), weights, REGIONS))


def pose(face, **faps):
    row = np.zeros((1, 68), np.float32)
    for name, value in faps.items():
        row[0, int(name[3:]) - 1] = value
    return deform(face, row)[0]


def test_folds_of_a_face_at_rest_do_not_show(face):
    assert not Folds(face)(face.vertices).any()


def test_folds_show_by_how_far_the_brows_are_squeezed(face):
    folds = Folds(face)
    seen = [folds(pose(face, fap37=v, fap38=v)) for v in (20, 40, 60)]
    assert seen[0][0] < seen[1][0] < seen[2][0] <= 1
    assert seen[2][0] == pytest.approx(seen[2][1], abs=0.05)
    assert not seen[2][2:].any()


def test_folds_of_one_side_show_on_that_side(face):
    folds = Folds(face)
    raised = folds(pose(face, fap31=240))
    assert raised[2] > 0.5
    assert not folds(pose(face, fap32=240))[2]


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize(
    ("region", "unit", "others"), [("nose", 9, (4, 10, 12, 22)), ("chin", 17, (12, 24, 26))]
)
def test_folds_of_a_region_show_with_their_own_unit(name, region, unit, others):
    """The nose wrinkles with AU9 only; the chin folds with AU17, not below a mouth that opens."""
    face = load_face(name)
    amounts = []
    for number in (unit, *others):
        frame = np.zeros((1, len(axis())), np.float32)
        for side in ("LEFT", "RIGHT") if by_number()[number].sides else ("BOTH",):
            frame[0, [target.column for target in au(number, side)]] = 1
        vertices = deform(face, poses(AUFrames(np.zeros(1), frame), face.inputs))[0]
        folds = Folds(face)
        amounts.append(folds.drives[face.maps.regions.index(f"{region}_left")](vertices))
    assert amounts[0] > 0.6
    assert max(amounts[1:]) < 0.35


@pytest.mark.parametrize("name", FACES)
def test_folds_of_the_chin_do_not_show_while_the_lips_are_rounded(name):
    face = load_face(name)
    spoken = pose(face, fap3=377, fap5=-200, fap6=-142, fap7=-142, fap16=330, fap17=320)
    assert Folds(face).drives[face.maps.regions.index("chin_left")](spoken) == 0


def test_folds_of_a_face_without_maps_are_none():
    assert not Folds(load_face("ada"))(load_face("ada").vertices).any()


def test_folds_as_numbers_have_a_drive_for_each_region(face):
    rows = Folds(face).to_json()
    assert len(rows) == len(REGIONS)
    assert rows[0][2] == pytest.approx(np.linalg.norm(face.vertices[rows[0][0]] - face.vertices[rows[0][1]]))
