"""Morph targets, compared with the drawn face."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.axis import fap
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.offline import realize
from realizer.outputs.morph_targets import TOLERANCE, make_arkit_targets, make_morph_targets

pytestmark = pytest.mark.xdist_group("outputs")


@pytest.fixture(scope="module", params=["mpeg4", "au"])
def played(request, turn):
    return realize(turn, deformer=request.param, voice="silent", fps=12.5)


def still(face, poses):
    """Return the vertices with neither head nor eyes turned."""
    rows = poses.copy()
    for number in (23, 24, 25, 26, 48, 49, 50):
        rows[:, face.inputs.index(fap(number).name)] = 0
    return rows


def test_morph_targets_are_exact_to_a_tenth_of_a_millimetre(played):
    face, made = played.face, make_morph_targets(played.face, played.poses)
    wanted = deform(face, still(face, played.poses))
    got = face.vertices + np.einsum("nk,kvc->nvc", made.weights, made.moves)
    assert np.abs(wanted - face.vertices).max() > 5e-3
    assert np.linalg.norm(got - wanted, axis=2).max() < 1.2 * TOLERANCE


def test_morph_targets_are_inputs_and_few_corrections(played):
    names = make_morph_targets(played.face, played.poses).names
    own = [name for name in names if not name.startswith("correction ")]
    assert {name.removesuffix(" reversed") for name in own} <= set(played.face.inputs)
    assert {"open_jaw", "close_t_l_eyelid"} <= set(own)
    assert len(names) - len(own) <= 36
    assert len(set(names)) == len(names)


def test_morph_target_weights_are_0_to_1(played):
    weights = make_morph_targets(played.face, played.poses).weights
    assert weights.min() == 0
    np.testing.assert_allclose(weights.max(axis=0), 1, atol=1e-6)


def test_morph_targets_exclude_head_and_eyes(played):
    made = make_morph_targets(played.face, played.poses)
    assert np.abs(made.head[:, 1]).max() > 0.05  # the head shakes
    assert np.abs(made.eyes).max() > 0.05  # the eyes look aside
    for ball, _ in played.face.basis["eyes"]:
        assert not made.moves[:, slice(*ball)].any()


def test_morph_targets_move_lids_with_pushed_eyeballs():
    face = load_face("default")
    poses = np.zeros((3, len(face.inputs)), np.float32)
    poses[:, face.inputs.index(fap(27).name)] = (0, 100, 200)
    made = make_morph_targets(face, poses)
    assert made.thrust[:, 0] == pytest.approx(np.array([0, 100, 200]) * face.fapu.metres("ES"))
    assert not made.thrust[:, 1].any()
    wanted = deform(face, poses)
    got = face.vertices + np.einsum("nk,kvc->nvc", made.weights, made.moves)
    (first, last), _ = face.basis["eyes"][0]
    got[:, first:last, 2] += made.thrust[:, :1]
    assert np.linalg.norm(got - wanted, axis=2).max() < 1.2 * TOLERANCE


def test_morph_targets_of_a_face_at_rest_are_empty():
    face = load_face("default")
    made = make_morph_targets(face, np.zeros((2, len(face.inputs)), np.float32))
    assert made.names == ()
    assert made.moves.shape == (0, len(face.vertices), 3)
    assert made.weights.shape == (2, 0)


def test_morph_targets_of_a_single_frame_are_exact(played):
    face, poses = played.face, played.poses[-1:]
    made = make_morph_targets(face, poses)
    wanted = deform(face, still(face, poses))
    got = face.vertices + np.einsum("nk,kvc->nvc", made.weights, made.moves)
    assert np.linalg.norm(got - wanted, axis=2).max() < 1.2 * TOLERANCE


@pytest.fixture(scope="module")
def speaking(turn):
    return realize(turn, voice="silent", fps=12.5)


def test_make_arkit_targets_weighs_shapes_as_arkit_does(speaking):
    made, frames = make_arkit_targets(speaking), arkit(speaking.aus, speaking.mapping)
    assert made.names == ARKIT_NAMES()
    assert np.array_equal(made.weights, frames.weights)
    assert made.moves.shape == (52, *speaking.face.vertices.shape)
    assert made.head == pytest.approx(frames.head[:, [1, 0, 2]])


def test_make_arkit_targets_come_near_the_face(speaking):
    made = make_arkit_targets(speaking)
    still = speaking.poses.copy()
    still[:, [k for k, name in enumerate(speaking.face.inputs) if name.startswith("head_")]] = 0
    wanted = deform(speaking.face, still) - speaking.face.vertices
    got = np.tensordot(made.weights, made.moves, 1)
    skin = slice(*speaking.face.parts["skin"])
    assert (
        np.linalg.norm((got - wanted)[:, skin], axis=2).mean()
        < 0.25 * np.linalg.norm(wanted[:, skin], axis=2).mean()
    )


def test_make_arkit_targets_leave_eyeballs_to_their_joints(speaking):
    made = make_arkit_targets(speaking)
    for name in ("left_eye", "right_eye"):
        assert not made.moves[:, slice(*speaking.face.parts[name])].any()
    assert np.abs(made.eyes).max() > 0.05
