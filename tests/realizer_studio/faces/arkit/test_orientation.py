"""Tests of finding how an imported head stands."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path

import numpy as np
import pytest
import trimesh

from realizer.core.errors import FaceError
from realizer_studio.faces.arkit.importer import inspect_head
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.arkit.orientation import pose_of

pytestmark = pytest.mark.xdist_group("fits")

WAYS = {
    "as glTF asks": np.eye(3),
    "+z up, facing +x": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]),
    "facing -z": np.diag([-1.0, 1, -1]),
}


@pytest.mark.parametrize(
    ("way", "scale", "unit"),
    [
        pytest.param(way, *scale, marks=() if k == n else pytest.mark.slow)
        for k, way in enumerate(WAYS)
        for n, scale in enumerate([(1.0, "metres"), (10.0, "decimetres"), (100.0, "centimetres")])
    ],
)
def test_pose_of_finds_unit_and_direction_by_the_shapes(
    write_head: Callable[..., Path], way: str, scale: float, unit: str
) -> None:
    found = inspect_head(write_head(scale=scale, turn=WAYS[way], sparse=scale > 1)).found
    assert any(f"in {unit}: its eyes stand" in line for line in found)
    assert not any("exchanged" in line for line in found)


def test_pose_of_exchanges_the_viewer_s_left_and_right(write_head: Callable[..., Path]) -> None:
    other = {"Left": "Right", "Right": "Left"}
    path = write_head(spell=lambda n: next((n[: -len(k)] + other[k] for k in other if n.endswith(k)), n))
    assert any("exchanged" in line for line in inspect_head(path).found)


PLACES = {
    "jawOpen": (0, -0.08, 0.06),
    "eyeBlinkLeft": (0.03, 0.03, 0.09),
    "eyeBlinkRight": (-0.03, 0.03, 0.09),
    "browInnerUp": (0, 0.06, 0.08),
    "mouthSmileLeft": (0.03, -0.05, 0.08),
    "mouthSmileRight": (-0.03, -0.05, 0.08),
}


def ball(places: Mapping[str, tuple[float, float, float]]) -> Surface:
    """Return a ball of 10 cm, whose shapes move what is near their places."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=0.1)
    at, n, m = np.asarray(mesh.vertices), len(mesh.vertices), len(mesh.faces)
    near = {name: np.linalg.norm(at - place, axis=1, keepdims=True) < 0.03 for name, place in places.items()}
    moves = {name: where * np.array([0, -0.01, 0]) for name, where in near.items()}
    colours, uv = np.zeros((n, 3)), np.zeros((m, 3, 2))
    ids = np.zeros(n, np.int32), np.zeros(m, np.int32)
    return Surface(at, mesh.faces, colours, ids[0], (("", "", ""),), moves, uv, ids[1], ())


def test_pose_of_stands_upright_between_the_eyes() -> None:
    pose = pose_of(ball(PLACES))
    assert not pose.swapped
    np.testing.assert_allclose(pose.turn, np.eye(3), atol=1e-9)


@pytest.mark.parametrize(
    ("same", "got"),
    [
        (PLACES, "left and right ones"),
        (("eyeBlinkLeft", "eyeBlinkRight"), "those of the left and the right eye"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_pose_of_refuses_shapes_that_move_the_same(same: Collection[str], got: str) -> None:
    places = {name: (0, 0.0, 0.1) if name in same else place for name, place in PLACES.items()}
    with pytest.raises(FaceError, match=f"different places of the face, got {got} that move the same"):
        pose_of(ball(places))


@pytest.mark.filterwarnings("error")
def test_pose_of_refuses_a_mouth_at_the_eyes() -> None:
    high = {name: (x, 0.0, 0.1) for name, (x, _, _) in PLACES.items()}
    with pytest.raises(FaceError, match="got those of eyes or brows and of the mouth that move the same"):
        pose_of(ball({name: high[name] for name in PLACES if name not in ("jawOpen", "browInnerUp")}))
