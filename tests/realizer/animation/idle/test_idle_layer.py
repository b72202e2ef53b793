"""Masks of idle motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.animation.axis import Target, au, mask_channel
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.idle_face import idle_face
from realizer.animation.idle.idle_layer import idle_layer, lids
from realizer.animation.idle.life import face_columns
from realizer.core.array_types import Float64


def still(target: Target, value: float, layer: Layer) -> Channel:
    return Channel(target, np.zeros(1), np.array([value]), layer=layer, keeps_last=True)


@pytest.mark.parametrize("mask", ["life", "motion"])
def test_idle_layer_masks_the_slow_motion_of_a_living_face(mask: str) -> None:
    times, idle = np.arange(0, 20, 0.04), idle_face(0.0, 20.0, 3, liveliness=1.0)
    columns = [au(number)[0].column for number in (1, 2, 12, 38)]
    masked = still(mask_channel(mask), 1.0, Layer.BASE)
    assert blend([], times, idle=idle).values[:, columns].any(axis=0).all()
    assert not blend([masked], times, idle=idle).values[:, columns].any()


def gaze_of(*masks: Channel) -> tuple[Float64, Float64]:
    """Return yaw and pitch of the eyes over a minute, without the head's motion; left and up are positive."""
    times, idle = np.arange(0, 60, 0.04), idle_face(0.0, 60.0, 3)
    motion = replace(
        idle.motion, poses=np.zeros_like(idle.motion.poses), steps=np.zeros_like(idle.motion.steps)
    )
    values = blend(masks, times, idle=replace(idle, motion=motion)).values
    left, right, up, down = (values[:, au(number)[0].column] for number in (61, 62, 63, 64))
    return 40.0 * (left - right), 30.0 * (up - down)


def test_idle_layer_shows_the_eyes_of_a_listener_and_of_a_thinker() -> None:
    listening, thinking, gaze = (
        still(mask_channel(name), 1.0, Layer.BASE) for name in ("listening", "thinking", "eyes")
    )
    usual, listens, thinks = gaze_of(), gaze_of(listening), gaze_of(thinking)
    assert np.hypot(*usual).max() < 3
    assert np.hypot(listens[0], listens[1] + 1).max() < 9
    assert np.mean(np.hypot(*listens) < 5) > 0.7  # on the other's face
    assert np.mean(np.hypot(*thinks) > 5) > 0.5  # averted
    assert np.mean(thinks[1] > 3) > np.mean(thinks[1] < -3)
    masked = gaze_of(thinking, replace(gaze, layer=Layer.GAZE))
    np.testing.assert_allclose(masked, usual, atol=1e-4)


def test_idle_layer_moves_brows_and_lower_lids_with_a_blink() -> None:
    idle, times = idle_face(0.0, 60.0, 3, liveliness=1.0), np.arange(0, 60, 0.02)
    blinking = idle_layer(idle, [], times)
    without = idle_layer(idle, [still(mask_channel("blinks"), 1.0, Layer.BASE)], times)
    shut = blinking.values[: len(lids())]
    for column, moves, rests in zip(blinking.face, blinking.small, without.small, strict=True):
        if column in face_columns(7):
            assert (moves >= 0.12 * shut[face_columns(7).index(column)]).all()
        if column in (*face_columns(7), *face_columns(4)):
            assert not np.array_equal(moves, rests)
            np.testing.assert_array_equal(moves[~shut.any(axis=0)], rests[~shut.any(axis=0)])
        else:
            np.testing.assert_array_equal(moves, rests)
