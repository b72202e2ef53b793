"""Tests of the landmarks of a face."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.landmarks import landmarks
from realizer_studio.tracking.network import Region
from tests.portraits import LITERT, pixels_of, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]

# Landmarks of the corners of mouth and eyes, the nose and the chin.
SAME = {"8.3": 291, "8.4": 61, "3.7": 263, "3.12": 33, "3.11": 362, "3.8": 133, "9.3": 1, "2.1": 152}


@pytest.mark.parametrize(("turn", "name"), [(0, "ada"), (12000, "ben"), (-15000, "nia")])
def test_landmarks_are_at_the_feature_points(turn: int, name: str) -> None:
    faps = np.zeros(68, np.float32)
    faps[[48, 49]] = turn, turn / 2
    picture, true = portrait(name, faps), pixels_of(name, faps)
    face = landmarks(picture, detect(picture)[0], refine=True)
    assert face.presence > 0.9
    wrong = [np.linalg.norm(face.points[k, :2] - true[point]) for point, k in SAME.items()]
    assert np.median(wrong) < 6  # of a face of 160 pixels
    assert max(wrong) < 16


def test_landmarks_of_an_empty_wall_are_not_present() -> None:
    wall = Image.new("RGB", (300, 300), (150, 140, 130))
    assert landmarks(wall, Region(150, 150, 200)).presence < 0.5


def test_irises_follow_the_gaze() -> None:
    faps = np.zeros(68, np.float32)
    faps[[22, 23]] = 30000  # to the character's left, the right of the picture
    ahead, aside = portrait(), portrait("ada", faps)
    at = [landmarks(picture, detect(picture)[0]).irises for picture in (ahead, aside)]
    assert (at[1] - at[0])[:, 0].min() > 2
    true = pixels_of("ada")
    assert at[0] == pytest.approx(np.array([true["3.5"], true["3.6"]]), abs=4)
