"""Tests of the rows of rigid parts."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.load import load_face
from realizer.face.model import Face
from realizer_studio.faces.mpeg4.rigid import balls as balls_of
from realizer_studio.faces.mpeg4.rigid import head_weight, jaw_pivot, pupil_rows, skin_only, tongue_rows


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face()


def test_balls_have_the_eyeballs_centre_and_radius(balls: tuple[Face, np.ndarray]) -> None:
    (left, radius), (right, _) = balls_of(balls[0].vertices.astype(float), balls[0].parts)
    assert left == pytest.approx([0.032, 0, -0.015], abs=1e-6)
    assert right == pytest.approx([-0.032, 0, -0.015], abs=1e-6)
    assert radius == pytest.approx(0.013, abs=1e-6)


def test_jaw_pivot_lies_before_the_ears(face: Face) -> None:
    x, y, z = jaw_pivot({name: tuple(at) for name, at in face.points.items()})
    assert abs(x) < 1e-4
    assert face.points["2.1"][1] < y < face.points["3.5"][1]
    assert face.points["10.5"][2] < z < face.points["3.5"][2]


def test_pupil_rows_widen_by_a_metre_for_each_metre(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    at, eyes = face.vertices.astype(float), balls_of(face.vertices.astype(float), face.parts)
    rows = pupil_rows(at, face.colours, face.parts, eyes)
    assert set(rows) == {29, 30}
    mine = slice(*face.parts["left_eye"])
    assert not rows[29][slice(*face.parts["right_eye"])].any()
    assert not rows[29][:, 2].any()
    assert np.hypot(*rows[29][mine, :2].T).max() == pytest.approx(0.5, rel=0.2)


def test_head_weight_is_whole_above_and_none_below(face: Face) -> None:
    at = face.vertices.astype(float)
    weight = head_weight(at, {name: tuple(p) for name, p in face.points.items()}, face.parts)
    skin = skin_only(len(at), face.parts) > 0
    assert (weight[skin & (at[:, 1] > 0)] == 1).all()
    assert (weight[skin & (at[:, 1] < at[skin, 1].min() + 0.01)] < 0.05).all()


def test_tongue_rows_move_the_tip_exactly(face: Face) -> None:
    at, points = face.vertices.astype(float), {name: tuple(p) for name, p in face.points.items()}
    rows = tongue_rows(at, points, face.parts)
    assert {43, 44, 45, 46} < set(rows)
    tip = face.feature_points["6.1"]
    assert rows[44][tip] == pytest.approx([0, 1, 0])
    assert rows[45][tip] == pytest.approx([0, 0, 1])
    assert not rows[44][slice(*face.parts["skin"])].any()
    assert tongue_rows(at, points, {"skin": face.parts["skin"]}) == {}


def test_head_weight_does_not_depend_on_where_the_head_is(face: Face) -> None:
    at, move = face.vertices.astype(float), np.array([0.3, -0.2, 0.1])
    weight = head_weight(at, {name: tuple(p) for name, p in face.points.items()}, face.parts)
    moved = head_weight(at + move, {name: tuple(p + move) for name, p in face.points.items()}, face.parts)
    assert moved == pytest.approx(weight, abs=1e-5)
