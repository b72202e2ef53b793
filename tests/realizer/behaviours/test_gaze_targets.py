"""Tests of gaze targets."""

from collections.abc import Mapping

import numpy as np
import pytest

from realizer.behaviours.gaze_targets import angles, known_direction, parse_scene
from realizer.behaviours.kind import PlanningContext, Position
from tests.realizer.behaviours.elements import SCENE, check, gaze, total

Scene = Mapping[str, Position] | None


def test_position_finds_names_of_the_scene_in_any_case() -> None:
    assert total(gaze("cup", world=SCENE), 0.5)[0][0] == pytest.approx(26.565, abs=0.01)
    assert total(gaze("door", world=SCENE), 0.5)[0][0] < -50
    assert not check('<gaze id="x" target="door"/>', SCENE)


def test_angles_without_a_scene_are_straight_ahead() -> None:
    assert not check('<gaze id="x" target="nobody"/>')
    assert total(gaze("nobody"), 0.5) == [(0, 0)]


@pytest.mark.parametrize("element", ["gaze", "gazeShift", "headDirectionShift"])
def test_check_target_suggests_names_for_an_unknown_one(element: str) -> None:
    (fault,) = check(f'<{element} id="x" target="cupp"/>', SCENE)
    assert fault.type == "NO_SUCH_TARGET"
    assert not fault.fatal
    assert "wanted one of cup" in fault.text
    assert "'cupp'" in fault.text
    assert not check(f'<{element} id="x" target="1, -2.5, .5"/>', SCENE)


def test_check_target_suggests_a_point_in_an_empty_scene() -> None:
    (fault,) = check('<gaze id="x" target="cup"/>', PlanningContext(scene={}))
    assert "0,0,1" in fault.text


def test_check_target_names_five_if_none_is_similar() -> None:
    context = PlanningContext(scene=dict.fromkeys("fedcba", (0.0, 0.0, 1.0)))
    (fault,) = check('<gaze id="x" target="cup"/>', context)
    assert "wanted one of a, b, c, d, e, got 'cup'" in fault.text


@pytest.mark.parametrize(
    ("target", "left", "up"),
    [
        ("LEFT", 1, 0),
        ("right", -1, 0),
        ("UP", 0, 1),
        ("DOWN", 0, -1),
        ("UPLEFT", 1, 1),
        ("down_right", -1, -1),
        ("LeftUp", 1, 1),
        ("CAMERA", 0, 0),
        ("User", 0, 0),
    ],
)
@pytest.mark.parametrize("scene", [None, {"cup": (0.0, 0.0, 1.0)}])
def test_known_direction_needs_no_scene(target: str, left: int, up: int, scene: Scene) -> None:
    context = PlanningContext(scene=scene)
    assert not check(f'<gaze id="x" target="{target}"/>', context)
    yaw, pitch, inward = angles(target, context)
    assert (np.sign(yaw), np.sign(pitch), inward) == (left, up, 0)


def test_known_direction_gives_way_to_a_scene_with_its_name() -> None:
    context = PlanningContext(scene={"camera": (1.0, 0.0, 1.0)})
    assert known_direction("CAMERA") == (0, 0)
    assert angles("CAMERA", context)[0] == pytest.approx(45)


def test_parse_scene_reads_lines_or_json() -> None:
    scene = {"cup": (0.1, -0.2, 0.5)}
    assert parse_scene("# what she sees\ncup 0.1 -0.2 0.5\n") == scene
    assert parse_scene('{"cup": [0.1, -0.2, 0.5]}') == scene
    with pytest.raises(ValueError, match="cup: wanted three numbers"):
        parse_scene("cup 1 2")


def test_parse_scene_reads_named_axes() -> None:
    assert parse_scene('{"cup": {"x": 1, "y": 2, "z": 3}}') == {"cup": (1.0, 2.0, 3.0)}
    assert parse_scene("cup 1, 2, 3") == {"cup": (1.0, 2.0, 3.0)}


@pytest.mark.parametrize("number", ["10001", "nan", "-inf"])
def test_parse_scene_refuses_positions_beyond_10_km(number: str) -> None:
    with pytest.raises(ValueError, match="cup: wanted metres within 10 km, got"):
        parse_scene(f"cup 0 {number} 0")
