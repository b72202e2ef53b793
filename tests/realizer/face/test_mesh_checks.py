"""Tests of the checks of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from realizer.face.mesh_checks import range_faults, surface_faults, value_faults
from realizer.face.model import Face

PARTS = {"skin": [0, 3], "left_eye": [3, 4], "right_eye": [4, 5]}


def mesh(**other: Any) -> dict[str, Any]:
    sound: dict[str, Any] = {name: np.zeros(5, np.uint8) for name in ("occlusion", "gloss")}
    sound |= {"vertices": np.zeros((5, 3)), "triangles": np.array([[0, 1, 2]])}
    return sound | {"colours": np.zeros((5, 3), np.uint8)} | other


def test_values_of_a_sound_mesh_have_no_fault() -> None:
    assert value_faults(mesh()) == []


@pytest.mark.parametrize(
    ("other", "fault"),
    [
        (
            {"vertices": np.array([[0, 0, 0]] * 4 + [[0, np.inf, 0]])},
            "vertices: 1 are not finite, the first is 4",
        ),
        ({"triangles": np.array([[0, 1, 5]])}, "triangles: wanted indices 0..4, got 0..5"),
        ({"triangles": np.array([[0, -1, 2]])}, "triangles: wanted indices 0..4, got -1..2"),
        ({"colours": np.zeros((5, 4), np.uint8)}, "colours: wanted 3 columns, got 4"),
        ({"gloss": np.zeros(4, np.uint8)}, "gloss: wanted 5 rows, one a vertex, got 4"),
        ({"occlusion": np.full(5, 300.0)}, "occlusion: wanted 0..255, got 300..300"),
        ({"occlusion": np.zeros(5)}, "occlusion: wanted bytes (uint8) 0..255, got float64"),
    ],
)
def test_values_that_no_mesh_holds_are_named(other: dict[str, Any], fault: str) -> None:
    (found,) = value_faults(mesh(**other))
    assert found.startswith(fault)


@pytest.mark.parametrize(
    ("parts", "fault"),
    [
        ({"skin": [0, 6]}, "parts: skin: wanted [first, last + 1] in 0..5, got [0, 6]"),
        ({"skin": [2, 2]}, "parts: skin: wanted"),
        ({"skin": [0.0, 3]}, "parts: skin: wanted"),
        ({"skin": "all"}, "parts: skin: wanted"),
    ],
)
def test_ranges_outside_the_mesh_are_named(parts: dict[str, Any], fault: str) -> None:
    (found,) = range_faults(PARTS | parts, 5)
    assert found.startswith(fault)


def test_ranges_of_parts_that_every_face_has_are_wanted() -> None:
    assert range_faults(PARTS, 5) == []
    assert range_faults({"skin": [0, 3]}, None) == [
        "parts: wanted 'left_eye', got none",
        "parts: wanted 'right_eye', got none",
    ]


def test_surface_without_a_hole_has_no_fault(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    assert surface_faults(*weld(face), face.parts, None) == []


def test_surface_with_a_flipped_triangle_is_named(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    welded, triangles = weld(face)
    triangles[1000] = triangles[1000, ::-1]
    faults = surface_faults(welded, triangles, face.parts, None)
    assert faults[0].startswith("skin: 1 triangles are inverted")


def test_surface_may_be_open_below_and_at_the_lids_alone(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    at, triangles = weld(face)
    skin = (triangles < face.parts["skin"][1]).all(axis=1)
    height = at[triangles, 1].min(axis=1)
    open_below = triangles[~(skin & (height < -0.12))]
    assert surface_faults(at, open_below, face.parts, None) == []
    back = np.linalg.norm(at[open_below].mean(axis=1) - [0, 0, -0.18], axis=1) < 0.03
    (fault,) = surface_faults(at, open_below[~back], face.parts, None)
    assert fault.startswith("skin: it has 1 hole beside the bust's end")
    assert fault.endswith("; close it")


def weld(face: Face) -> tuple[np.ndarray, np.ndarray]:
    """The mesh with one vertex at each place, and no triangle without an area."""
    _, first, group = np.unique(np.round(face.vertices, 6), axis=0, return_index=True, return_inverse=True)
    triangles = first[group.ravel()[face.triangles]].astype(np.int32)
    a, b, c = triangles.T
    return face.vertices.astype(float), triangles[(a != b) & (b != c) & (c != a)]
