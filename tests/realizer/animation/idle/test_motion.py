"""Idle motion of head and eyes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer import tables
from realizer.animation.axis import AU_NAMES
from realizer.animation.idle.motion import motion_between


def test_idle_eyes_move_in_saccades() -> None:
    motion = motion_between(0, 60, 1)
    still = np.zeros_like(motion.poses)
    eyes = replace(motion, poses=still, steps=still)  # a head that keeps still
    most = np.array([tables.by_number()[int(AU_NAMES()[column])].degrees for column in motion.columns[-4:]])
    for start, lasts in zip(motion.jumps[3:50], motion.durations[3:50], strict=True):
        times = start + lasts * np.arange(-0.25, 1.26, 0.05)
        degrees = (eyes.at(times)[-4:] * most[:, None]).reshape(2, 2, -1)
        gaze = degrees[:, 1] - degrees[:, 0]
        gone = np.hypot(*(gaze - gaze[:, :1]))
        way = float(gone[-1])
        assert lasts == pytest.approx(0.021 + 0.0022 * way)  # Carpenter 1988
        assert (gone[:6] < 1e-9).all()
        np.testing.assert_allclose(gone[25:], way, atol=1e-9)
        assert gone[15] == pytest.approx(way / 2)  # half-way at half of the time, on a straight line
        assert (np.diff(gone) > -1e-9).all()
