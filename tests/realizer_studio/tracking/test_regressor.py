"""Tests of action units from pictures."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import rotations
from realizer_studio.analysis.faps_from_points import head_angles
from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.landmarks import Landmarks, landmarks
from realizer_studio.tracking.regressor import (
    MEASURED_UNITS,
    UP,
    Measured,
    components,
    measure,
    stored,
    upright,
)
from tests.portraits import LITERT, faps_of, portrait


def test_shapes_are_those_of_the_head_in_any_pose() -> None:
    head = stored()["head"]
    angles = np.array([[0.2, -0.1, 0.3], [-0.4, 0.6, 0.0]])
    turns = rotations(*angles.T.astype(np.float32))
    pixels = (np.einsum("nij,pj->npi", turns, head) * 70 + (10, -20, 5)) * UP
    found, shapes = upright(pixels, head)
    assert head_angles(found) == pytest.approx(angles, abs=1e-5)
    assert shapes[1] == pytest.approx(head, abs=1e-4)


pytestmark = [LITERT, pytest.mark.gl("onboard")]


def seen(faps: np.ndarray | None = None) -> Landmarks:
    picture = portrait("ida", faps)
    return landmarks(picture, detect(picture)[0], refine=True)


def measured(faps: np.ndarray, with_neutral: bool = True) -> Measured:
    neutral = components([seen()]).values[0]
    return measure(components([seen(faps)]), neutral if with_neutral else None)


@pytest.mark.parametrize("with_neutral", [True, False])
@pytest.mark.parametrize("unit", ["4", "12", "15", "26", "43"])
def test_units_that_a_picture_shows_are_measured(unit: str, with_neutral: bool) -> None:
    found = measured(faps_of("ida", **{f"AU{unit}": 0.9}), with_neutral)
    values = dict(zip(MEASURED_UNITS, found.units[0], strict=True))
    shown = [value for name, value in values.items() if name.rstrip("LR") == unit]
    assert min(shown) > 0.35
    assert all(0 <= value <= 1 for value in values.values())


def test_a_neutral_picture_shows_nothing_against_itself() -> None:
    found = measured(np.zeros(68, np.float32))
    assert found.units.max() < 0.25


def test_units_of_one_side_are_told_apart() -> None:
    faps = faps_of("ida", AU12=0.9)
    right = [13, 7, 60, 54, 9, 11, 56, 58, 42]
    faps[[fap - 1 for fap in right]] = 0
    values = dict(zip(MEASURED_UNITS, measured(faps).units[0], strict=True))
    assert values["12L"] > values["12R"] + 0.1


def test_faps_and_the_head_are_measured() -> None:
    faps = faps_of("ida", AU12=0.8)
    faps[48] = np.radians(15) / 1e-5
    found = measured(faps).faps[0]
    assert np.degrees(found[47:50] * 1e-5) == pytest.approx((0, 15, 0), abs=6)
    assert found[[11, 12]] == pytest.approx(faps[[11, 12]], rel=0.6)


def test_eyes_that_look_aside_are_measured() -> None:
    faps = np.zeros(68, np.float32)
    faps[[22, 23]] = np.radians(18) / 1e-5
    assert np.degrees(measured(faps).faps[0, [22, 23]] * 1e-5).min() > 6
