"""Lids before eyes: no eye comes through a lid, and closed lids hide it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Bool, Float32, Float64, Int32
from realizer.face.basis import bulge_at
from realizer.face.deform import deform, rotations
from realizer.face.drawn_mesh import DrawnMesh, drawn_mesh
from realizer.face.load import load_face
from realizer.face.model import Face
from tests.shipped import FACES

DEEPEST = 0.0003  # m
OPEN = {("omar", (64,)): 0.91}  # the lids of an old man leave a slit when he looks down with closed eyes
LOOKS = ((), (61,), (62,), (63,), (64,))
ACTIONS = (
    (),
    (5,),
    (7,),
    (43,),
    (1, 2, 5, 26),
    (4, 5, 7, 23),
    (6, 12),
    (9, 10),
    (1, 4, 15),
    (1, 2, 4, 5, 20),
)


def posed(face: Face, units: tuple[int, ...], amount: float = 1.0) -> tuple[Float32, Float32]:
    """Return the pose (1, k) of action units and the vertices of the face (n, 3)."""
    values = np.zeros((1, len(axis())), np.float32)
    for unit in units:
        values[0, [target.column for target in au(unit)]] = amount
    pose = poses(AUFrames(np.zeros(1), values), face.inputs)
    return pose, deform(face, pose)[0]


def outside(face: Face, eye: int, pose: Float32, places: Any) -> Float64:
    """Return how far places (k, 3) are out of an eyeball in metres, negative inside."""
    _, centre = face.basis["eyes"][eye]
    turns = pose[:, [24 + eye, 22 + eye]] * np.float32(1e-5)
    ahead = rotations(turns[:, 0], turns[:, 1], np.zeros(1, np.float32))[0] @ [0, 0, 1]
    away = places - centre
    bulge = face.basis["bulges"][eye]
    return np.asarray(np.linalg.norm(away, axis=1) - bulge[2] - bulge_at(bulge, away, ahead))


def lid_triangles(face: Face, mesh: DrawnMesh, eye: int) -> Int32:
    """Return the drawn triangles (t, 3) of skin that slide over an eye and lie before it at rest."""
    other = np.ones(len(face.vertices))
    other[face.basis["lid"][face.basis["lid_eye"] == eye]] = 0
    rest = mesh.places @ face.vertices
    first, last = mesh.parts["skin"]
    away = outside(face, eye, np.zeros((1, 68), np.float32), rest)
    mine = (abs(mesh.places) @ other < 1e-6) & (away > 0) & (away < 0.003)
    mine[:first] = mine[last:] = False
    mine &= rest[:, 2] > face.basis["eyes"][eye][1][2] + 0.003
    return np.asarray(mesh.triangles[mine[mesh.triangles].all(axis=1)])


def hidden(places: Any, triangles: Any) -> Bool:
    """Return which places (k, 3) have a triangle (t, 3, 3) in front of them."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    p = places[:, None]

    def side(u: Any, v: Any) -> Any:
        return (v[:, 0] - u[:, 0]) * (p[..., 1] - u[:, 1]) - (v[:, 1] - u[:, 1]) * (p[..., 0] - u[:, 0])

    shares = np.stack([side(b, c), side(c, a), side(a, b)])
    total = shares.sum(axis=0)
    depth = (shares * np.stack([a[:, 2], b[:, 2], c[:, 2]])[:, None]).sum(axis=0) / np.where(total, total, 1)
    return np.asarray(((shares >= 0).all(axis=0) & (depth > p[..., 2] - DEEPEST)).any(axis=1))


@pytest.fixture(scope="module", params=FACES)
def head(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def test_eyes_stay_behind_lids_in_every_look_and_expression(head: Face) -> None:
    mesh = drawn_mesh(head)
    lids = [lid_triangles(head, mesh, eye) for eye in (0, 1)]
    assert min(len(triangles) for triangles in lids) > 50
    for units in [look + action for look in LOOKS for action in ACTIONS]:
        pose, vertices = posed(head, units)
        drawn = mesh.places @ vertices
        for eye, triangles in enumerate(lids):
            middles = drawn[triangles].mean(axis=1)
            for places in (drawn[np.unique(triangles)], middles):
                assert outside(head, eye, pose, places).min() > -DEEPEST, (units, eye)


def hidden_share(face: Face, mesh: DrawnMesh, units: tuple[int, ...], eye: int) -> float:
    """Return how much of the front of an eye the skin hides."""
    drawn = mesh.places @ posed(face, units)[1]
    skin = mesh.triangles[(mesh.triangles < mesh.parts["skin"][1]).all(axis=1)]
    centre = face.basis["eyes"][eye][1]
    near = drawn[skin[np.abs(drawn[skin].mean(axis=1) - centre).max(axis=1) < 0.025]]
    ball = drawn[slice(*mesh.parts[("left_eye", "right_eye")[eye]])]
    return float(hidden(ball[ball[:, 2] > centre[2] + 0.007], near).mean())


def test_closed_lids_hide_the_eyes_wherever_they_look(head: Face) -> None:
    mesh = drawn_mesh(head)
    for eye in (0, 1):
        assert hidden_share(head, mesh, (), eye) < 0.8
        for look in LOOKS:
            assert hidden_share(head, mesh, (*look, 43), eye) > OPEN.get((head.name, look), 0.98)
