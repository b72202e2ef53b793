"""Tests of the shirt."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.face.mesh_geometry import edges_of
from realizer.tables import toml_table
from realizer_studio.faces.parts import Part, Submesh
from realizer_studio.faces.person.clothing import (
    CLEAR,
    VERTEX_DISTANCE,
    decimate_hidden,
    glasses,
    glasses_of,
    shirt,
    under_collar,
)

CHIN = np.array([0, -0.11, 0.0])
lengths = st.floats(-0.2, 0.2)
Sheet = tuple[Submesh, np.ndarray]


@pytest.fixture
def sheet() -> Sheet:
    """A sheet of 11 x 11 vertices, 20 cm wide, in the plane of the chin."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 11), np.linspace(-0.3, -0.1, 11))
    base = np.stack([x.ravel(), y.ravel(), np.zeros(121)], 1)
    k = np.arange(121).reshape(11, 11)
    quads = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], -1).reshape(-1, 4)
    return Submesh.of_quads(quads.astype(np.int32), 121), base


@given(lengths, lengths, lengths, st.floats(0.01, 0.1))
def test_under_collar_counts_metres_downwards(x: float, y: float, z: float, down: float) -> None:
    high, low = (under_collar(np.array([[x, at, z]]), CHIN, 0.17)[0] for at in (y, y - down))
    assert low - high == pytest.approx(down)


@given(lengths, lengths, st.floats(0, 0.05))
def test_under_collar_ends_lower_by_low(x: float, y: float, low: float) -> None:
    place = np.array([[x, y, 0.0]])
    assert under_collar(place, CHIN, 0.17, low) == pytest.approx(under_collar(place, CHIN, 0.17) - low)


def test_under_collar_is_pointed_in_the_middle_of_the_front_alone() -> None:
    places = np.array([[0, -0.2, 0], [0.05, -0.2, 0], [0, -0.2, -0.12]])
    change = under_collar(places, CHIN, 0.17) - under_collar(places, CHIN, 0.17, point=0.03)
    assert change == pytest.approx([0.03, 0, 0])


def test_shirt_lies_off_the_body_below_the_neckline(sheet: Sheet) -> None:
    skin, base = sheet
    low = -0.2 - skin.positions(base)[:, 1]
    part = shirt(skin, base, low, [10, 20, 30])
    assert part.name == "shirt"
    assert (np.abs(part.vertices[:, 2]) > 0.002).all()
    assert part.vertices[:, 1].max() == pytest.approx(-0.2, abs=1e-6)
    assert (part.colours <= [10, 20, 30]).all()


def test_decimate_hidden_keeps_chosen_and_lit_vertices(sheet: Sheet) -> None:
    skin, base = sheet
    at = skin.positions(base)
    dark = np.where(at[:, 1] < -0.2, 0.1, 1.0)
    part = Part("skin", skin, at, skin.triangles, np.zeros((121, 3)), np.zeros(121), dark)
    keep = np.zeros(121, bool)
    keep[24] = True
    fewer = decimate_hidden(part, keep, np.zeros(121, bool), chin=-1.0, floor=-0.3)
    left = {tuple(place) for place in fewer.vertices.tolist()}
    assert len(left) < 121
    assert tuple(at[24]) in left
    assert all(tuple(place) in left for place in at[dark == 1].tolist())


def test_decimate_hidden_leaves_the_creases_of_a_shirt_above_its_lower_end(sheet: Sheet) -> None:
    skin, base = sheet
    at = skin.positions(base)
    at[::2, 2] += 0.002
    part = Part("shirt", skin, at, skin.triangles, np.zeros((121, 3)), np.zeros(121), np.ones(121))

    def left(floor: float) -> int:
        nothing = np.zeros(121, bool)
        return len(decimate_hidden(part, nothing, nothing, chin=0.0, floor=floor).vertices)

    assert left(floor=at[:, 1].min() - 0.1) == 121
    assert left(floor=at[:, 1].max()) < 80


@pytest.fixture(scope="module")
def head():
    face = load_face("ada")
    skin = face.vertices[slice(*face.parts["skin"])].astype(float)
    eyes = [(face.points[point] - np.array([0, 0, 0.012]), 0.012) for point in ("3.5", "3.6")]
    return skin, eyes, [face.points["10.1"], face.points["10.2"]]


@pytest.fixture(params=list(toml_table("glasses.toml")))
def made(request, head):
    return glasses(glasses_of({"style": request.param}), *head)


def test_glasses_stand_before_the_eyes(made, head):
    front = max(centre[2] + radius for centre, radius in head[1])
    assert front < made.vertices[:, 2].max() < front + VERTEX_DISTANCE + 0.003
    for centre, _ in head[1]:
        rim = made.vertices[(made.vertices[:, 2] > front - 0.002) & (made.vertices[:, 0] * centre[0] > 0)]
        assert rim[:, 0].min() < centre[0] - 0.015
        assert rim[:, 0].max() > centre[0] + 0.015


def test_glasses_reach_behind_the_ears(made, head):
    for ear in head[2]:
        mine = made.vertices[made.vertices[:, 0] * ear[0] > 0]
        assert mine[:, 2].min() < ear[2]


def test_glasses_leave_the_skin_beside_the_temples_free(made, head):
    skin, _, ears = head
    temple = made.vertices[(made.vertices[:, 2] < 0) & (made.vertices[:, 2] > ears[0][2] + 0.02)]
    for point in temple:
        beside = skin[(np.abs(skin[:, 1:] - point[1:]) < 0.004).all(axis=1) & (skin[:, 0] * point[0] > 0)]
        assert not len(beside) or np.abs(beside[:, 0]).max() < abs(point[0]) + CLEAR / 2


def test_glasses_are_tubes_with_nothing_but_their_ends_open(made):
    _, counts = edges_of(made.triangles)
    assert counts.max() == 2
    assert (counts == 1).sum() == 2 * 3 * 6  # two temples and a bridge


def test_glasses_take_other_figures():
    assert glasses_of({"style": "round", "width": 0.03})["width"] == 0.03
    assert glasses_of({}) is None


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ({"style": "monocle"}, "style: wanted one of round, square, got 'monocle'"),
        ({"style": "round", "widht": 1}, "got 'widht', did you mean width?"),
        ({"style": "round", "width": "wide"}, r"width: wanted 0\.0235 or the like, got 'wide'"),
    ],
)
def test_glasses_name_what_is_wrong(table, fault):
    with pytest.raises(FaceError, match=fault.replace("?", r"\?")):
        glasses_of(table)
