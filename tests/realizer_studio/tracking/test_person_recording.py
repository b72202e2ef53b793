"""Tests of recordings: rest, gaps, rates."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.follower import Person
from realizer_studio.tracking.landmarks import landmarks
from realizer_studio.tracking.person_recording import Recording, rate_of, record
from realizer_studio.tracking.regressor import MEASURED_UNITS
from tests.portraits import LITERT, faps_of, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


def person(*strengths: float) -> Person:
    """Someone who smiles in some pictures; NaN is a picture without the face."""
    found = Person()
    for number, strength in enumerate(strengths):
        if not np.isnan(strength):
            picture = portrait("ada", faps_of("ada", AU12=strength))
            found.frames.append(number)
            found.faces.append(landmarks(picture, detect(picture)[0], refine=True))
    return found


def smile(recording: Recording) -> np.ndarray:
    return recording.units[:, MEASURED_UNITS.index("12L")]


def test_record_finds_rest_in_the_film_itself() -> None:
    recording = record(person(0, 0, 0, 1, 1, 1, 1, 1, 1, 1), np.arange(10) / 5, 5)
    assert smile(recording)[0] < 0.2
    assert smile(recording)[5:].min() > 0.5


def test_record_measures_against_a_given_neutral_face() -> None:
    recording = record(person(1, 1, 1), [0, 0.2, 0.4], 5, neutral=person(0))
    assert smile(recording).min() > 0.5


def test_record_fills_short_gaps_and_leaves_long_ones() -> None:
    nothing = float("nan")
    smiling = person(0, 0, 0, 1, nothing, 1, 1, *[nothing] * 15, 1, 1)
    recording = record(smiling, np.arange(24) / 10, 10)
    assert recording.visible.tolist() == [True] * 7 + [False] * 15 + [True] * 2
    assert smile(recording)[4] > 0.5
    assert not recording.faps[10].any()


def test_record_takes_times_of_a_variable_rate() -> None:
    times = [0, 0.1, 0.2, 0.6, 0.7, 1.0]
    recording = record(person(0, 0, 0, 1, 1, 1), times, 10)
    assert recording.times == pytest.approx(np.arange(11) / 10)
    assert smile(recording)[1] < 0.2
    assert smile(recording)[9] > 0.5  # between 0.7 and 1.0
    assert recording.visible.all()


def test_rate_is_that_of_most_pictures() -> None:
    assert rate_of([0, 0.04, 0.08, 0.12, 0.92, 0.96]) == 25
    assert rate_of([0]) == 25
