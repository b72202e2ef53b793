"""Tests of the fields that a head's shapes make."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from realizer.face.basis import unpack
from realizer.face.load import folder_of, load_face
from realizer.face.mesh_geometry import part_triangles
from realizer.tables import faps
from realizer_studio.faces.arkit.mouth import mouth_of
from realizer_studio.faces.arkit.shape_fields import ShapedSkin, shape_fields
from realizer_studio.faces.mpeg4.defaults import split_sides
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS

pytestmark = pytest.mark.xdist_group("fits")


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    """All that a shaped skin of ada knows but its shapes."""
    face = load_face("ada")
    first, last = face.parts["skin"]
    at, triangles = face.vertices.astype(float), part_triangles(face.triangles, (first, last))
    points = {name: tuple(place.tolist()) for name, place in face.points.items()}
    sides = split_sides(at, face.triangles, points, (first, last))
    lids = {side: np.zeros(last - first) for side in (1, -1)}
    for side, word in ((1, "left"), (-1, "right")):
        lids[side][sides[f"upper_lid_{word}"] - first] = 1
    with np.load(folder_of("ada") / "fields.npz") as file:
        rows = unpack(file, len(at))
    skin = at[first:last]
    vertex = {k: v - first for k, v in face.feature_points.items() if first <= v < last}
    zones = {fap: row[first:last] for fap, row in rows.items()}
    mouth = mouth_of(skin, triangles, points, sides["upper_lip"] - first)
    return {"skin": skin, "triangles": triangles, "points": points, "vertex": vertex, "mouth": mouth,
            "upper_lid": lids, "zones": zones}  # fmt: skip


def shaped(known: Mapping[str, Any], **weights: Mapping[int, float]) -> ShapedSkin:
    """Return the skin with shapes that are sums of ada's own FAPs, in metres."""
    moves = {
        name: sum(
            (metres * known["zones"][fap] for fap, metres in parts.items()), np.zeros_like(known["skin"])
        )
        for name, parts in weights.items()
    }
    return ShapedSkin(moves=moves, **known)


SHAPES: dict[str, dict[int, float]] = {
    "browInnerUp": {31: 0.01, 32: 0.01, 33: 0.004, 34: 0.004},
    "browOuterUpLeft": {35: 0.01, 33: 0.006},
    "browOuterUpRight": {36: 0.01, 34: 0.006},
    "eyeBlinkLeft": {19: 0.008, 21: 0.002},
    "eyeBlinkRight": {20: 0.008, 22: 0.002},
    "mouthSmileLeft": {6: 0.004, 12: 0.006, 53: 0.004, 59: 0.006},
    "mouthSmileRight": {7: 0.004, 13: 0.006, 54: 0.004, 60: 0.006},
    "mouthStretchLeft": {6: 0.008, 53: 0.008, 12: -0.001, 59: -0.001},
    "mouthStretchRight": {7: 0.008, 54: 0.008, 13: -0.001, 60: -0.001},
    "cheekSquintLeft": {41: 0.005},
    "cheekSquintRight": {42: 0.005},
}


def test_shape_fields_move_each_feature_point_by_one(known: dict[str, Any]) -> None:
    made = shape_fields(shaped(known, **SHAPES))
    assert {31, 33, 35, 19, 20, 6, 12, 53, 59, 41, 42} <= set(made)
    for fap, field in made.items():
        row = faps()[fap - 1]
        move = field[known["vertex"][row.feature_point]]
        assert move @ np.array(DIRECTIONS[row.direction]) == pytest.approx(1), row.name


def test_shape_fields_divide_the_lips_among_their_points(known: dict[str, Any]) -> None:
    upper = {4: -0.004, 51: -0.004, 8: -0.005, 9: -0.005, 55: -0.005, 56: -0.005}
    lower = {5: -0.006, 52: -0.006, 10: -0.005, 11: -0.005, 57: -0.005, 58: -0.005}
    half = {fap: metres / 2 for fap, metres in upper.items()}
    made = shape_fields(shaped(known, mouthUpperUpLeft=half, mouthUpperUpRight=half, jawOpen=lower))
    for fap in (*upper, *lower):
        row = faps()[fap - 1]
        along = made[fap] @ np.array(DIRECTIONS[row.direction])
        assert along[known["vertex"][row.feature_point]] == pytest.approx(1), row.name
        assert along.max() < 1.5, row.name


def test_shape_fields_need_both_shapes_of_a_pair(known: dict[str, Any]) -> None:
    assert shape_fields(shaped(known)) == {}
    one = {name: parts for name, parts in SHAPES.items() if name in ("mouthSmileLeft", "browInnerUp")}
    assert shape_fields(shaped(known, **one)) == {}


def test_shape_fields_leave_the_other_side(known: dict[str, Any]) -> None:
    made = shape_fields(shaped(known, **SHAPES))
    right = known["skin"][:, 0] < -0.02
    for fap in (35, 19, 12, 41):
        assert np.abs(made[fap][right]).max() < 0.02


def test_shaped_skin_exact_refuses_shapes_that_go_elsewhere(known: dict[str, Any]) -> None:
    skin = shaped(known)
    assert skin.exact(31, np.tile([0, -0.01, 0.0], (len(known["skin"]), 1))) is None
    up = skin.exact(31, np.tile([0, 0.01, 0.0], (len(known["skin"]), 1)))
    assert up is not None
    assert np.allclose(up[:, 1], 1)


def test_shaped_skin_without_takes_the_part_of_other_faps(known: dict[str, Any]) -> None:
    skin, own = shaped(known), known["zones"][41]
    rest = skin.without(0.004 * own, {}, (41,))
    assert np.allclose(rest, 0, atol=1e-9)


def test_shaped_skin_move_sums_shapes_or_is_none(known: dict[str, Any]) -> None:
    skin = shaped(known, cheekSquintLeft={41: 0.005}, cheekSquintRight={42: 0.005})
    both = skin.move("cheekSquintLeft", "cheekSquintRight")
    assert both is not None
    assert np.allclose(both, 0.005 * (known["zones"][41] + known["zones"][42]))
    assert skin.move("cheekSquintLeft", "jawOpen") is None
