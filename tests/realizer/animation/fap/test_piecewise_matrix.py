"""Piecewise linear functions from AUs to FAPs."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.axis import AU_NAMES, au
from realizer.animation.fap.piecewise_matrix import PiecewiseMatrix
from realizer.core.array_types import Float32
from realizer.tables import AuToFap

AT = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0)


def asked(rows: tuple[AuToFap, ...], fap: int) -> Float32:
    """Return the values of a FAP as AU26 rises."""
    aus = np.zeros((len(AU_NAMES()), len(AT)), np.float32)
    aus[au(26)[0].column] = AT
    raised, lowered, turned = PiecewiseMatrix.of(rows).evaluate(aus)
    found: Float32 = (raised - lowered + turned)[fap - 1]
    return found


def test_matrix_is_constant_between_two_pieces() -> None:
    rows = (AuToFap(26, "", 3, 0.1, 0.3, 0.0, 100.0), AuToFap(26, "", 3, 0.7, 0.9, 100.0, 300.0))
    assert asked(rows, 3) == pytest.approx([0, 0, 50, 100, 100, 100, 300, 300], abs=1e-3)


def test_matrix_of_no_rows_is_zero() -> None:
    assert not asked((), 3).any()


def test_matrix_mask_has_the_faps_of_rows_and_speech() -> None:
    mask = PiecewiseMatrix.of((AuToFap(9, "L", 63, 0.0, 1.0, 0.0, 30.0),)).mask
    assert mask[62]
    assert mask[2]  # speech opens the jaw
    assert not mask[[0, 1, 30]].any()


def test_matrix_separates_raising_and_lowering() -> None:
    rows = (AuToFap(26, "", 3, 0.0, 0.5, 0.0, 100.0), AuToFap(26, "", 3, 0.5, 1.0, 100.0, -100.0))
    aus = np.zeros((len(AU_NAMES()), len(AT)), np.float32)
    aus[au(26)[0].column] = AT
    raised, lowered, _ = PiecewiseMatrix.of(rows).evaluate(aus)
    assert np.flatnonzero(raised.any(axis=1)).tolist() == [2]
    assert raised[2] == pytest.approx([0, 20, 40, 60, 100, 20, 0, 0], abs=1e-3)
    assert lowered[2] == pytest.approx([0, 0, 0, 0, 0, 0, 60, 100], abs=1e-3)


def test_matrix_closed_is_the_greatest_value_of_each_fap() -> None:
    rows = (AuToFap(43, "L", 19, 0.0, 1.0, 0.0, 200.0), AuToFap(7, "L", 19, 0.0, 1.0, 0.0, 900.0))
    closed = PiecewiseMatrix.of(rows).closed
    assert closed[18] == 900
    assert np.count_nonzero(closed) == 1
