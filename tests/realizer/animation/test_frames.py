"""Frames and their moving columns."""

from __future__ import annotations

import numpy as np

from realizer.animation.axis import AU_NAMES, au, axis, fap
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.tables.cooccurrence import rules

SMILE, BROW = au(12, "LEFT")[0].column, au(1, "LEFT")[0].column


def rows(*columns: int) -> Float32:
    values = np.zeros((3, len(axis())), np.float32)
    values[:, columns] = np.array([[0.25], [0.5], [0.75]])
    return values


def test_frames_find_their_moving_columns() -> None:
    assert AUFrames(np.arange(3.0), rows(SMILE, fap(3).column)).moving_columns == (SMILE, fap(3).column)
    assert AUFrames(np.arange(3.0), rows()).moving_columns == ()


def test_frames_ignore_named_columns_that_do_not_move() -> None:
    named = AUFrames(np.arange(3.0), rows(SMILE), rules(), columns=tuple(range(len(axis()))))
    found = AUFrames(np.arange(3.0), rows(SMILE), rules())
    np.testing.assert_array_equal(named.aus, found.aus)
    np.testing.assert_array_equal(named.moving, found.moving)
    np.testing.assert_array_equal(to_fap(named).values, to_fap(found).values)
    np.testing.assert_array_equal(to_fap(named).mask, to_fap(found).mask)


def test_frames_concatenate_moving_columns() -> None:
    smile, brow, unknown = (
        AUFrames(np.arange(3.0), rows(column), columns=columns)
        for column, columns in ((SMILE, (SMILE,)), (BROW, (BROW,)), (BROW, None))
    )
    assert AUFrames.concatenate([smile, brow]).columns == (BROW, SMILE)
    assert AUFrames.concatenate([smile, unknown]).columns is None
    assert AUFrames.concatenate([smile, unknown]).moving_columns == (BROW, SMILE)


def test_frames_have_a_moving_row_for_each_action_unit() -> None:
    frames = AUFrames(np.arange(3.0), rows(SMILE), rules())
    assert frames.moving.shape == (len(AU_NAMES()), 3)
    np.testing.assert_array_equal(frames.moving.T, frames.before_rules)
