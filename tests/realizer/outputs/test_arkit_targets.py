"""Tests of morph targets with ARKit's names."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.face.deform import deform
from realizer.offline import realize
from realizer.outputs.arkit_targets import make_arkit_targets

pytestmark = pytest.mark.xdist_group("outputs")


@pytest.fixture(scope="module")
def played(turn):
    return realize(turn, voice="silent", fps=12.5)


def test_make_arkit_targets_weighs_shapes_as_arkit_does(played):
    made, frames = make_arkit_targets(played), arkit(played.aus, played.mapping)
    assert made.names == ARKIT_NAMES()
    assert np.array_equal(made.weights, frames.weights)
    assert made.moves.shape == (52, *played.face.vertices.shape)
    assert made.head == pytest.approx(frames.head[:, [1, 0, 2]])


def test_make_arkit_targets_come_near_the_face(played):
    made = make_arkit_targets(played)
    still = played.poses.copy()
    still[:, [k for k, name in enumerate(played.face.inputs) if name.startswith("head_")]] = 0
    wanted = deform(played.face, still) - played.face.vertices
    got = np.tensordot(made.weights, made.moves, 1)
    skin = slice(*played.face.parts["skin"])
    assert (
        np.linalg.norm((got - wanted)[:, skin], axis=2).mean()
        < 0.25 * np.linalg.norm(wanted[:, skin], axis=2).mean()
    )


def test_make_arkit_targets_leave_eyeballs_to_their_joints(played):
    made = make_arkit_targets(played)
    for name in ("left_eye", "right_eye"):
        assert not made.moves[:, slice(*played.face.parts[name])].any()
    assert np.abs(made.eyes).max() > 0.05
