"""The FAPs of a shape of the mouth."""

from __future__ import annotations

import numpy as np
import pytest

from realizer import tables
from realizer.animation.lips.mouth_faps import ROLL, mouth_faps
from realizer.animation.lips.visemes import SHAPE_COLUMNS, shape_table


def shape(**parts: float) -> np.ndarray:
    return np.array([[parts.get(name, 0.0) for name in SHAPE_COLUMNS]])


def test_mouth_faps_of_an_open_mouth_are_negative_in_both_lips() -> None:
    got = mouth_faps(shape(jaw=300, upper=100, lower=200))
    assert (got[3][0], got[4][0], got[5][0]) == (300, -100, -200)
    assert all(got[fap][0] < 0 for fap in (8, 9, 10, 11, 51, 52, 55, 56, 57, 58))


def test_mouth_faps_never_raise_the_jaw() -> None:
    assert mouth_faps(shape(jaw=-50))[3][0] == 0


def test_mouth_faps_move_both_sides_and_contours() -> None:
    got = mouth_faps(shape(width=-40, corner=8))
    assert {got[fap][0] for fap in (6, 7, 53, 54)} == {-40}
    assert {got[fap][0] for fap in (12, 13, 59, 60)} == {8}


def test_mouth_faps_push_the_lips_and_move_the_tongue() -> None:
    got = mouth_faps(shape(push_lower=1, push_upper=2, tip=3, thrust=4, body=5, roll=6))
    wanted = {16: 1, 17: 2, 44: 3, 45: 4, 46: 5, 47: 6 * ROLL}
    assert {fap: values[0] for fap, values in got.items() if values[0]} == wanted


def test_mouth_faps_of_pressed_lips_are_thin_and_roll_in() -> None:
    got = mouth_faps(shape(upper=-16, lower=-20))
    assert got[51][0] > got[4][0]
    assert got[52][0] > got[5][0]
    assert got[16][0] < 0
    assert got[17][0] < 0


@pytest.mark.parametrize("viseme", range(15))
def test_mouth_faps_of_every_viseme_are_within_their_range(viseme: int) -> None:
    for fap, values in mouth_faps(shape_table()[0][[viseme]]).items():
        row = tables.faps()[fap - 1]
        assert row.least <= values[0] <= row.most
