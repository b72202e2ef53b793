"""Tests of the rows that FAPs add beyond their limits."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.basis import BEYOND, LIMITS
from realizer.face.load import load_face
from realizer.tables import faps
from realizer_studio.faces.mpeg4.fap_measures import Measure, flips_of
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS
from realizer_studio.faces.person.makehuman import Figure
from tests.shipped import FACES

pytestmark = pytest.mark.xdist_group("mask")
Fields = dict[int, np.ndarray]


def test_far_fields_move_each_feature_point_by_one(figure: Figure, fields: Fields) -> None:
    for fap in LIMITS:
        row = faps()[fap - 1]
        move = fields[BEYOND + fap][figure.points[row.feature_point]]
        assert move @ np.array(DIRECTIONS[row.direction]) == pytest.approx(1), row.name


def test_far_fields_of_two_sides_mirror(figure: Figure, fields: Fields) -> None:
    twin = figure.mesh.mirror()
    for fap in LIMITS:
        row = faps()[fap - 1]
        mirrored = row.sign * fields[BEYOND + row.mirror][twin] * [-1, 1, 1]
        assert np.allclose(fields[BEYOND + fap], mirrored, atol=1e-9), row.name


@pytest.mark.parametrize("name", FACES)
def test_far_fields_let_little_skin_turn_over_at_half_a_face_s_distance(name: str) -> None:
    measure = Measure.of(load_face(name))
    for fap in LIMITS:
        most = 0.015 if fap in (41, 42) else 0.01  # a cheek that is lifted so far folds below the eye
        assert flips_of(measure, faps()[fap - 1], {fap: 512.0}) < most, fap
