"""Measures of single FAPs on a face."""

from __future__ import annotations

import numpy as np

from realizer.face.load import load_face
from realizer.tables import faps
from realizer_studio.faces.mpeg4.fap_measures import (
    Measure,
    asymmetry_of,
    error_of,
    roughness_of,
    side_effect_of,
)


def test_measures_of_a_shipped_face_are_small() -> None:
    measure, row = Measure.of(load_face()), faps()[30]
    moves = measure.displacement({31: 100.0})
    assert error_of(measure, row, 100.0, moves) < 0.01
    assert asymmetry_of(measure, row, moves, measure.displacement({32: 100.0})) < 0.012
    assert roughness_of(measure, row, moves[measure.skin]) < 0.25


def test_measures_find_a_move_that_is_too_short_and_one_that_drags() -> None:
    measure, row = Measure.of(load_face()), faps()[3]
    moves = measure.displacement({4: 100.0})
    assert 0.4 < error_of(measure, row, 100.0, moves / 2) < 0.6
    assert side_effect_of(measure, row, [100.0], [moves]) < 0.05
    whole = np.ones_like(moves) * moves[measure.face.feature_points["2.2"]]
    assert side_effect_of(measure, row, [100.0], [whole]) > 0.9
