"""Tests of idle."""

import numpy as np
import pytest

from bml_schema import parse
from realizer.animation.axis import AU_NAMES
from realizer.behaviours.registry import VOCABULARY
from realizer.playback.player import Player
from tests.realizer.behaviours.conftest import NAMESPACES

LONG = '<wait id="w" duration="60"/>'
LID = AU_NAMES().index("45L")
MOVING = [AU_NAMES().index(str(number)) for number in (51, 52, 53, 54, 55, 56, 61, 62, 63, 64)]


def aus(play, body: str) -> np.ndarray:
    return play(body + LONG, idle=True).realization.aus.aus


def blinks(frames: np.ndarray) -> list[int]:
    """Return the frames at which a lid begins to close."""
    lid = frames[:, LID] > 0
    return np.flatnonzero(lid[1:] & ~lid[:-1]).tolist()


def test_idle_without_blinks_and_motion_is_still(play) -> None:
    still = aus(play, '<own:idle id="i" blinks="0" motion="0" start="0" end="0.1"/>')
    assert not still[10:].any()
    assert aus(play, "")[10:].any()


def test_idle_motion_shrinks_evenly_and_blinks_stay(play) -> None:
    usual = aus(play, "")
    less = aus(play, '<own:idle id="i" motion="0.25" start="0" end="0.1"/>')
    np.testing.assert_allclose(less[10:, MOVING], usual[10:, MOVING] * 0.25, atol=1e-6)
    np.testing.assert_array_equal(less[:, LID], usual[:, LID])


def test_idle_blinks_are_some_of_the_usual_ones_and_close_the_eyes(play) -> None:
    usual, fewer = aus(play, ""), aus(play, '<own:idle id="i" blinks="0.5" start="0" end="0.1"/>')
    assert set(blinks(fewer)) < set(blinks(usual))
    assert 0.2 < len(blinks(fewer)) / len(blinks(usual)) < 0.8
    for begin in blinks(fewer):
        np.testing.assert_array_equal(fewer[begin : begin + 31, LID], usual[begin : begin + 31, LID])


def test_idle_blinks_of_a_quarter_are_among_those_of_a_half(play) -> None:
    some = [
        set(blinks(aus(play, f'<own:idle id="i" blinks="{part}" start="0" end="0.1"/>')))
        for part in (0.25, 0.5, 1)
    ]
    assert some[0] <= some[1] <= some[2]


def test_idle_of_a_later_behaviour_replaces_an_earlier_one(play) -> None:
    usual = aus(play, "")
    back = aus(
        play,
        '<own:idle id="i" blinks="0" motion="0" start="0" end="0.1"/>'
        '<own:idle id="j" start="20" end="20.5"/>',
    )
    assert not back[10:2000].any()
    np.testing.assert_allclose(back[2100:], usual[2100:], atol=1e-6)


def test_idle_motion_fades_and_no_lid_jumps(play) -> None:
    usual = aus(play, "")
    begin = blinks(usual)[3] / 100 + 0.05  # while the lids close
    control = f'<own:idle id="i" blinks="0" motion="0" start="{begin}" end="{begin + 0.1}"/>'
    frames = aus(play, control)
    steps = np.abs(np.diff(frames, axis=0)).max(axis=0)
    assert np.all(steps <= np.abs(np.diff(usual, axis=0)).max(axis=0) + 0.04)
    end = blinks(usual)[3] + int((usual[blinks(usual)[3] + 1 :, LID] == 0).argmax()) + 1
    np.testing.assert_array_equal(frames[:end, LID], usual[:end, LID])
    assert not frames[end:, LID].any()


@pytest.mark.parametrize("late", [-0.06, -0.02, 0.02, 0.1, 0.2])
def test_idle_frames_live_are_those_offline_when_blinks_return(late: float) -> None:
    times = np.arange(0, 12, 0.04)
    begins = times[blinks(Player().frames(times).aus)][1] + 0.04
    body = '<own:idle id="i" blinks="0" start="0" end="0.1"/>'
    body += f'<own:idle id="j" start="{begins + late}" end="{begins + late + 0.04}"/>'
    player = Player(history=float("inf"))
    player.submit(parse(f'<bml id="b" {NAMESPACES}>{body}</bml>', VOCABULARY), 0.0)
    player.due(12)
    film = player.frames(times).aus[:, LID]
    live = np.concatenate([player.frames(times[k : k + 1]).aus[:, LID] for k in range(len(times))])
    np.testing.assert_array_equal(live, film)
    assert set(film[film > 0]) <= set(Player().frames(times).aus[:, LID])


def test_idle_leaves_blinks_of_the_document(play) -> None:
    frames = aus(play, '<own:idle id="i" blinks="0" start="0" end="0.1"/><own:blink id="k" start="5"/>')
    assert blinks(frames) == [500]


def test_idle_eyes_and_liveliness_are_masks(play) -> None:
    control = '<own:idle id="i" liveliness="{}" eyes="{}" start="0" end="0.1"/>'
    usual, calm = aus(play, ""), aus(play, control.format(0, "WAITING"))
    assert usual[10:, AU_NAMES().index("38L")].max() > 0.1
    assert not calm[10:, AU_NAMES().index("38L")].any()
    thinks = aus(play, control.format(1, "THINKING"))
    up, down = (AU_NAMES().index(str(number)) for number in (63, 64))
    assert np.mean((thinks - usual)[200:, up] - (thinks - usual)[200:, down]) > 0.02
    np.testing.assert_array_equal(np.delete(thinks, MOVING, 1), np.delete(usual, MOVING, 1))
