"""Tests of the highlights on the eyes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from realizer.render.eye_highlights import EyeHighlights
from realizer.render.light import preset, unit

FRONT = np.array([0, 0, 1], np.float32)


def test_eye_highlights_lie_between_key_and_camera(balls):
    face, _ = balls
    points = EyeHighlights(face, preset(), FRONT)(face.vertices)
    assert len(points) == 22
    for name, cap in zip(("left_eye", "right_eye"), np.split(points, 2), strict=True):
        first, last = face.parts[name]
        centre = face.vertices[first:last].mean(axis=0)
        out = unit(cap[0] - centre)
        assert out[2] > 0.5
        assert out[0] < 0  # the key stands at the character's right


def test_eye_highlights_follow_the_eye_also_on_the_page(balls):
    face, _ = balls
    glints = EyeHighlights(face, preset(), FRONT)
    moved = face.vertices + np.array([0.01, -0.02, 0.005], np.float32)
    assert glints(moved) - glints(face.vertices) == pytest.approx(
        np.tile([0.01, -0.02, 0.005], (len(glints(moved)), 1)), abs=1e-5
    )
    for eye, cap in zip(
        json.loads(json.dumps(glints.to_json()))["eyes"], np.split(glints(moved), 2), strict=True
    ):
        weights = np.array(eye["weights"])
        centre = weights @ moved[eye["first"] : eye["first"] + len(weights)]
        assert np.linalg.norm(cap - centre, axis=1) == pytest.approx(eye["radius"], rel=0.01)
