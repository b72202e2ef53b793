"""`glasses`: frames that stand before the eyes and rest on the ears, outside the skin."""

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.face.mesh_geometry import edges_of
from realizer.facebuild.person.glasses import CLEAR, VERTEX_DISTANCE, glasses, glasses_of
from realizer.tables import toml_table


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
        ({"style": "round", "widht": 1}, "got 'widht'; did you mean 'width'?"),
        ({"style": "round", "width": "wide"}, r"width: wanted 0\.0235 or the like, got 'wide'"),
    ],
)
def test_glasses_name_what_is_wrong(table, fault):
    with pytest.raises(FaceError, match=fault.replace("?", r"\?")):
        glasses_of(table)
