"""Tests of cameras."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from realizer.core.errors import RenderError
from realizer.render.cameras import PRESETS, camera_for, camera_names

SIZES = [(512, 512), (640, 480), (300, 500)]


@pytest.mark.parametrize("size", SIZES)
def test_front_camera_puts_hairline_to_chin_in_the_middle_half(balls, size):
    face, _ = balls
    (x, hairline), (_, chin) = camera_for(face).project([face.points["11.1"], face.points["2.1"]], size)[0]
    assert (chin - hairline) / size[1] == pytest.approx(0.5)
    assert (chin + hairline) / 2 / size[1] == pytest.approx(0.47)
    assert x == pytest.approx(size[0] / 2)


@pytest.mark.parametrize("name", PRESETS)
def test_camera_presets_put_hairline_and_chin_as_framed(balls, name):
    face, _ = balls
    places = (
        camera_for(face, name).project([face.points["11.1"], face.points["2.1"]], (400, 1000))[0][:, 1] / 1000
    )
    assert places == pytest.approx([PRESETS[name].hairline, PRESETS[name].chin])


@pytest.mark.parametrize("name", PRESETS)
def test_camera_for_has_the_head_between_near_and_far(balls, name):
    face, _ = balls
    camera = camera_for(face, name)
    depths = (camera.position - face.vertices) @ camera.towards
    assert camera.near < depths.min()
    assert depths.max() < camera.far


def test_camera_presets_from_aside_show_the_right_cheek(balls):
    """The nose points to the picture's right: the camera stands at the character's right."""
    face, _ = balls
    for name in ("three-quarter", "profile"):
        nose, back = camera_for(face, name).project([[0, 0, 0.02], [0, 0, -0.15]], (512, 512))[0][:, 0]
        assert nose > back + 30


def test_camera_shows_the_character_s_left_on_the_right(balls):
    face, _ = balls
    left, right = camera_for(face).project([[0.03, 0, 0], [-0.03, 0, 0]], (512, 512))[0][:, 0]
    assert left > right


def test_camera_for_takes_a_face_s_own_camera(balls):
    face, _ = balls
    face = replace(face, cameras={"hero": {"yaw": 20, "distance": 1.2}})
    assert "hero" in camera_names(face)
    assert camera_for(face, "hero").position[0] > 0.3


def test_camera_for_lists_the_known_cameras_for_an_unknown_one(balls):
    with pytest.raises(RenderError, match=r"front, three-quarter, profile, close, got 'top'"):
        camera_for(balls[0], "top")


def test_camera_to_json_gives_the_same_view(balls):
    """Rebuilt from the JSON the way a WebGL library does it."""
    face, _ = balls
    camera = camera_for(face, "three-quarter")
    table = json.loads(json.dumps(camera.to_json()))
    back = np.subtract(table["position"], table["target"])
    back /= np.linalg.norm(back)
    right = np.cross(table["up"], back)
    right /= np.linalg.norm(right)
    point = face.points["11.1"]
    local = np.array([right, np.cross(back, right), back]) @ (point - table["position"])
    scale = 256 / np.tan(np.radians(table["fovy"]) / 2)
    seen = [256 + scale * local[0] / -local[2], 256 - scale * local[1] / -local[2]]
    assert camera.project(point, (512, 512))[0][0] == pytest.approx(seen, abs=0.05)


def test_fitted_camera_shows_the_whole_head_in_a_narrow_picture(balls) -> None:
    face, _ = balls
    camera = camera_for(face)
    assert camera.fitted((512, 512)).fovy == pytest.approx(camera.fovy)
    usual, narrow = (camera.fitted(size).project(face.vertices, size)[0] for size in ((330, 500), (100, 500)))
    assert np.ptp(narrow[:, 0]) / 100 == pytest.approx(np.ptp(usual[:, 0]) / 330)
