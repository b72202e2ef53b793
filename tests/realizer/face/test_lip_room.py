"""Tests of the room of lips: no pose brings teeth into them."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.lip_room import lip_room
from realizer.face.load import load_face
from realizer.face.model import Face
from tests.penetration import (
    DEEPEST,
    MouthParts,
    action_unit_poses,
    emotion_poses,
    fap_poses,
    viseme_poses,
)  # fmt: skip
from tests.shipped import FACES

BACK = 400.0  # FAPU that both lips go back: 7 mm
# m that a last molar is in the cheek when the jaw of a closed mouth goes aside by 7 mm.
KNOWN = {("omar", "FAP 15 +150"): 0.0018, ("omar", "FAP 15 -150"): 0.0018}


@pytest.fixture(scope="module")
def ada() -> Face:
    return load_face("ada")


def pushed_back(face: Face, jaw: float = 0) -> np.ndarray:
    row = np.zeros((1, 68), np.float32)
    row[0, [2, 15, 16]] = jaw, -BACK, -BACK
    return deform(face, row)[0]


@pytest.mark.parametrize("jaw", [0, 500])
def test_lip_room_moves_lips_out_of_the_teeth(ada: Face, jaw: float) -> None:
    mouth = MouthParts(ada)
    assert mouth.teeth_in_lips(pushed_back(ada, jaw)) < DEEPEST
    # A face that seems to have no teeth has no room.
    toothless = {name: ends for name, ends in ada.parts.items() if name != "lower_teeth"}
    assert mouth.teeth_in_lips(pushed_back(replace(ada, parts=toothless), jaw)) > 0.001


def test_lip_room_keeps_a_face_at_rest(ada: Face) -> None:
    room, out = lip_room(ada), ada.vertices[None].copy()
    assert room is not None
    room(out)
    assert np.array_equal(out[0], ada.vertices)


@pytest.mark.slow
@pytest.mark.parametrize("name", FACES)
def test_lip_room_keeps_teeth_out_of_lips_in_every_pose(name: str) -> None:
    face = load_face(name)
    names, rows = zip(
        *((names, rows[:, :68]) for names, rows in
          (action_unit_poses(face), viseme_poses(), fap_poses(), emotion_poses(face))),
        strict=True,
    )  # fmt: skip
    mouth = MouthParts(face)
    depth = np.array([mouth.teeth_in_lips(shape) for shape in deform(face, np.concatenate(rows))])
    labels = [label for group in names for label in group]
    print(name, *(f"{labels[k]} {1000 * depth[k]:.2f} mm" for k in np.argsort(-depth)[:6]), sep="; ")
    most = np.array([KNOWN.get((name, label), DEEPEST) for label in labels])
    assert (depth < most).all(), [(labels[k], 1000 * depth[k]) for k in np.flatnonzero(depth >= most)]
