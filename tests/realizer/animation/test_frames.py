"""Frames and their moving action units."""

from __future__ import annotations

import numpy as np

from realizer.animation.axis import AU_NAMES, au, axis
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.tables.cooccurrence import rules

SMILE = au(12, "LEFT")[0].column


def rows(*columns: int) -> Float32:
    values = np.zeros((3, len(axis())), np.float32)
    values[:, columns] = np.array([[0.25], [0.5], [0.75]])
    return values


def test_frames_have_a_moving_row_for_each_action_unit() -> None:
    frames = AUFrames(np.arange(3.0), rows(SMILE), rules())
    assert frames.moving.shape == (len(AU_NAMES()), 3)
    np.testing.assert_array_equal(frames.moving.T, frames.before_rules)
