"""Tests of gaze targets."""

from __future__ import annotations

import pytest

from realizer.behaviours.kind import PlanningContext
from tests.realizer.behaviours.elements import SCENE, check, gaze, total


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
