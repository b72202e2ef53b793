"""Tests of finding which vertices are what."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.model import Face
from realizer.facebuild.arkit.part_classifier import ball_behind, ball_of, is_ball, part_of


@pytest.mark.parametrize(
    ("names", "part"),
    [
        (("Teeth_Lower", "", ""), "teeth"),
        (("", "Hair", ""), "hair"),
        (("Skin", "Tongue", ""), "tongue"),
        (("Skin", "", "Head"), "skin"),
        (("", "Object_1", ""), ""),
    ],
)
def test_a_part_is_named_by_its_material_mesh_or_node(names: tuple[str, str, str], part: str) -> None:
    assert part_of(names) == part


def test_a_ball_is_found_with_its_centre_and_radius(balls: tuple[Face, np.ndarray]) -> None:
    face, _ = balls
    eye, head = (face.vertices[slice(*face.parts[name])].astype(float) for name in ("left_eye", "skin"))
    centre, radius = ball_of(eye)
    assert centre == pytest.approx([0.032, 0, -0.015], abs=1e-6)
    assert radius == pytest.approx(0.013, abs=1e-6)
    assert is_ball(eye)
    assert is_ball(eye[eye[:, 2] > -0.015])
    assert not is_ball(head)
    assert not is_ball(eye * 3)
    assert not is_ball(eye[:11])


def test_a_ball_lies_behind_a_painted_eye() -> None:
    centre, radius = ball_behind(np.array([[0.02, 0.01, 0.03], [0.04, -0.01, 0.02]]))
    assert centre == pytest.approx([0.03, 0, 0.03 - radius])
