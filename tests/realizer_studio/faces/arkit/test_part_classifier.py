"""Tests of finding which vertices are what."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.model import Face
from realizer_studio.faces.arkit.part_classifier import ball_behind, is_ball


def test_is_ball_accepts_eyes_and_parts_of_them(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    eye, head = (face.vertices[slice(*face.parts[name])].astype(float) for name in ("left_eye", "skin"))
    assert is_ball(eye)
    assert is_ball(eye[eye[:, 2] > -0.015])
    assert not is_ball(head)
    assert not is_ball(eye * 3)
    assert not is_ball(eye[:11])


def test_ball_behind_lies_behind_a_painted_eye() -> None:
    centre, radius = ball_behind(np.array([[0.02, 0.01, 0.03], [0.04, -0.01, 0.02]]))
    assert centre == pytest.approx([0.03, 0, 0.03 - radius])
