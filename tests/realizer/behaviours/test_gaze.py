"""Tests of gaze and gazeShift."""

import numpy as np
import pytest

from tests.realizer.behaviours.elements import at, degrees, expand, gaze, timing, total


@pytest.mark.parametrize("influence", ["", "EYES", "HEAD", "NECK", "SHOULDER", "WAIST", "WHOLE", "TAIL"])
def test_gaze_turns_eyes_and_head_together_to_the_target(influence: str) -> None:
    look = gaze("0.4,0.2,1", f'influence="{influence}"' if influence else "")
    wanted = (np.degrees(np.arctan2(0.4, 1)), np.degrees(np.arctan2(0.2, np.hypot(0.4, 1))))
    assert total(look, 0.5)[0] == pytest.approx(wanted, abs=0.01)
    assert total(look, 1.5)[0] == pytest.approx(wanted, abs=0.01)
    assert total(look, 2.0)[0] == (0, 0)


def test_gaze_turns_the_eyes_back_as_the_head_follows() -> None:
    look = gaze("0.4,0,1", 'influence="HEAD"')
    times = np.linspace(0.1, 0.5, 41)
    assert degrees(look, "head", 0.1)[0] == (0, 0)
    assert degrees(look, "head", 0.5)[0][0] > 5
    yaw = [angle[0] for angle in total(look, *times)]
    assert yaw == pytest.approx([yaw[-1]] * len(yaw), abs=0.01)


def test_gaze_influence_splits_the_angle() -> None:
    parts = [
        degrees(gaze("0.4,0,1", f'influence="{word}"'), "head", 0.5)[0][0]
        for word in ("EYES", "HEAD", "WHOLE")
    ]
    assert parts[0] == 0 < parts[1] < parts[2]


def test_gaze_turns_the_head_where_the_eyes_are_at_their_limit() -> None:
    look = gaze("2,0,1")
    assert abs(degrees(look, "eyes", 0.5)[0][0]) <= 35.001
    assert total(look, 0.5)[0][0] == pytest.approx(np.degrees(np.arctan2(2, 1)), abs=0.01)
    behind = gaze("0.01,0,-1")
    assert total(behind, 0.5)[0][0] == pytest.approx(95, abs=0.01)
    only_eyes = gaze("2,0,1", 'influence="EYES"')
    assert total(only_eyes, 0.5)[0][0] == pytest.approx(35, abs=0.01)


@pytest.mark.parametrize(
    ("direction", "wanted"),
    [("RIGHT", (-10, 0)), ("LEFT", (10, 0)), ("UP", (0, 10)), ("DOWN", (0, -10)), ("UPLEFT", (7.07, 7.07))],
)
def test_gaze_offset_turns_by_degrees(direction: str, wanted: tuple[float, float]) -> None:
    look = gaze("user", f'offsetAngle="10" offsetDirection="{direction}"')
    assert total(look, 0.5)[0] == pytest.approx(wanted, abs=0.01)


def test_gaze_converges_the_eyes_on_near_targets() -> None:
    near, far = at(gaze("0,0,0.3"), "66", 0.5)[0], at(gaze("0,0,5"), "66", 0.5)[0]
    assert near > 0.3 > 0.05 > far


def test_gaze_masks_the_base_gaze_and_restores_it() -> None:
    away = expand('<gazeShift id="s" target="-0.6,0,1" influence="HEAD"/>', (0, 0.1))
    look = [*away, *(channel.shifted(1.0) for channel in gaze("0.4,0,1"))]
    base = total(away, 5)[0]
    assert total(look, 1.0)[0] == pytest.approx(base)
    assert total(look, 2.0)[0] == pytest.approx((np.degrees(np.arctan2(0.4, 1)), 0), abs=0.01)
    assert total(look, 3.0)[0] == pytest.approx(base)


def test_gaze_of_the_eyes_alone_is_quick() -> None:
    assert timing('<gaze id="x" target="a" influence="EYES"/>').preferred[0] <= 0.15
