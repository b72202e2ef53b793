"""Tests of the face value."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.model import Face, Fapu
from realizer.tables import faps

FAPU = Fapu(irisd0=0.01, es0=0.06, ens0=0.05, mns0=0.03, mw0=0.04)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("IRISD", 0.01), ("ES", 0.06), ("ENS", 0.05), ("MNS", 0.03), ("MW", 0.04)],
)
def test_fapu_is_a_1024th_of_its_distance(unit: str, metres: float) -> None:
    assert FAPU.metres(unit) == pytest.approx(metres / 1024)


def test_fapu_has_the_unit_of_every_fap() -> None:
    units = {row.unit for row in faps()}
    assert {unit for unit in units if FAPU.metres(unit) == 0} == {"none"}
    assert FAPU.metres("angle_unit") == 1e-5


def test_face_has_bounds_and_the_inputs_of_68_faps(balls: tuple[Face, np.ndarray]) -> None:
    low, high = balls[0].bounds
    assert low == pytest.approx([-0.075, -0.145, -0.18], abs=1e-3)
    assert high == pytest.approx([0.075, 0.085, 0.0], abs=3e-3)
    assert balls[0].inputs == tuple(row.name for row in faps())
