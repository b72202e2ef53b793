"""Tests of pictures of the default face, by landmarks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.render.cameras import camera_for
from realizer.render.renderer import Renderer
from tests.pictures import drawn_here

pytestmark = [pytest.mark.gl, pytest.mark.xdist_group("render")]

SIZE = (256, 256)
OPEN = {3: 900, 5: -900, 10: -750, 11: -750, 52: -900, 57: -750, 58: -750}


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer("default", SIZE) as renderer:
        yield renderer


@pytest.fixture(scope="module")
def face():
    return load_face("default")


def row(**faps) -> np.ndarray:
    out = np.zeros((1, 68), np.float32)
    for name, value in faps.items():
        out[0, int(name[3:]) - 1] = value
    return out


def row_of(values: dict[int, float]) -> np.ndarray:
    return row(**{f"fap{fap}": value for fap, value in values.items()})


def place(face, *points: str, rows=None) -> np.ndarray:
    """Pixels of feature points, on the neutral face or where the vertices nearest to them have moved."""
    if rows is None:
        return camera_for(face).project([face.points[p] for p in points], SIZE)[0]
    vertices = deform(face, rows)[0]
    return camera_for(face).project(vertices[[face.feature_points[p] for p in points]], SIZE)[0]


def patch(picture, corners) -> np.ndarray:
    (left, top), (right, bottom) = np.floor(corners.min(0)).astype(int), np.ceil(corners.max(0)).astype(int)
    return picture[top : bottom + 1, left : right + 1].astype(float)


def test_face_has_hairline_and_chin_as_framed(face):
    (_, hairline), (_, chin) = place(face, "11.1", "2.1") / SIZE[1]
    assert chin - hairline == pytest.approx(0.5, abs=0.015)
    assert (chin + hairline) / 2 == pytest.approx(0.47, abs=0.015)


@pytest.mark.slow
def test_face_picture_is_framed_as_projected(renderer, face):
    """Skin starts below the hairline; below the chin the neck is in shade: both seen, not computed."""
    picture = renderer.draw(row())[0].astype(int)
    column = picture[:, 126:131].mean(1)
    warm = column[:, 0] - column[:, 2] > 35
    hairline = place(face, "11.1")[0, 1]
    assert warm[round(hairline) + 6 : round(hairline) + 20].all()
    assert not warm[: round(hairline) - 16].any() or column[: round(hairline) - 16].sum(1).max() < 420


def test_face_picture_is_not_blank_and_not_burnt(renderer):
    picture = renderer.draw(row())[0]
    assert picture.std() > 30
    assert (picture.min(2) > 250).mean() < 0.002
    assert (picture.max(2) < 8).mean() < 0.01


def test_face_skin_is_warm_and_brighter_towards_the_key(renderer, face):
    picture = renderer.draw(row())[0].astype(float)
    cheeks = {}
    for side, point in (("left", "5.1"), ("right", "5.2")):
        x, y = place(face, point)[0].round().astype(int)
        cheeks[side] = picture[y - 3 : y + 4, x - 3 : x + 4].mean((0, 1))
        assert cheeks[side][0] > cheeks[side][1] > cheeks[side][2]
        assert 120 < cheeks[side][0] < 252
    assert cheeks["right"].sum() > cheeks["left"].sum()


def test_face_mouth_is_darker_open_than_closed(renderer, face):
    closed, opened = renderer.draw(np.concatenate([row(), row_of(OPEN)]))
    hole = place(face, "2.2", "2.3", "2.6", "2.7", rows=row_of(OPEN))
    assert np.ptp(hole[:, 1]) > 8
    assert patch(opened, hole).mean() < patch(closed, hole).mean() - 15


def test_face_lids_hide_the_eyes_and_their_glints(renderer, face):
    opened, closed = renderer.draw(np.concatenate([row(), row(fap19=1024, fap20=1024)]))
    for corners in (("3.7", "3.11", "3.1", "3.3"), ("3.8", "3.12", "3.2", "3.4")):
        box = place(face, *corners)
        assert patch(opened, box).min(2).max() > 195  # a glint, or the white of the eye
        assert patch(closed, box).min(2).max() < 190


@pytest.mark.slow
def test_face_eyes_have_a_glint_in_the_iris(face):
    (picture,) = drawn_here("default", (1024, 1024), row())
    for point in ("3.5", "3.6"):
        x, y = camera_for(face).project(face.points[point], (1024, 1024))[0][0].round().astype(int)
        eye = picture[y - 12 : y + 4, x - 14 : x + 4]
        assert eye.min(2).max() > 225
        assert eye.max(2).min() < 60  # beside the dark pupil


def test_face_turned_to_its_left_looks_to_the_right(renderer, face):
    straight, turned = renderer.draw(np.concatenate([row(), row(fap49=30000)]))
    nose = place(face, "9.3", rows=row(fap49=30000))[0] - place(face, "9.3")[0]
    assert nose[0] > 5
    assert np.abs(straight.astype(int) - turned).mean() > 3


@pytest.mark.parametrize(
    "camera", ["three-quarter", pytest.param("profile", marks=pytest.mark.slow), "close"]
)
@pytest.mark.slow
def test_face_is_shown_by_every_camera(camera):
    (picture,) = drawn_here("default", (128, 128), row(), camera)
    warm = picture[..., 0].astype(int) - picture[..., 2] > 35
    assert warm.mean() > 0.1
    assert not warm[:, :2].any()
