"""Tests of the base mesh with its identity."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.facebuild.person.base_mesh import UP, Ground, scaled

pytestmark = pytest.mark.xdist_group("mask")


def test_ground_smoothed_keeps_what_is_even(ground: Ground) -> None:
    even = ground.smoothed(np.full(len(ground.at), 2.0), 3)
    assert np.allclose(even[ground.body], 2)


def test_ground_smoothed_shrinks_the_range_of_a_field(ground: Ground) -> None:
    rough = np.where(ground.body, np.random.default_rng(1).uniform(-1, 1, len(ground.at)), 0)
    spans = [np.ptp(ground.smoothed(rough, times)[ground.body]) for times in range(4)]
    assert spans == sorted(spans, reverse=True)


def test_ground_ellipsoid_falls_from_the_centre_to_its_radii(ground: Ground) -> None:
    centre = ground.point("9.3")
    reach = ground.ellipsoid(centre, (0.03, 0.03, 0.03))
    away = np.linalg.norm(ground.at - centre, axis=1)
    assert reach[ground.points["9.3"]] == 1
    assert not reach[(away >= 0.03) | ~ground.body].any()
    inside = np.flatnonzero(ground.body & (away < 0.03))
    assert (np.diff(reach[inside[np.argsort(away[inside])]]) <= 1e-12).all()


def test_ground_ellipsoid_is_one_on_its_plateau(ground: Ground) -> None:
    reach = ground.ellipsoid(ground.point("9.3"), (0.03, 0.03, 0.03), 0.5)
    near = ground.body & (np.linalg.norm(ground.at - ground.point("9.3"), axis=1) < 0.0149)
    assert (reach[near] == 1).all()
    assert (reach >= ground.ellipsoid(ground.point("9.3"), (0.03, 0.03, 0.03))).all()


def test_ground_fapu_are_distances_of_its_points(ground: Ground) -> None:
    fapu = ground.fapu()
    assert fapu.es0 == pytest.approx(ground.point("3.1")[0] - ground.point("3.2")[0], rel=1e-5)
    assert fapu.mw0 == pytest.approx(ground.point("8.3")[0] - ground.point("8.4")[0], rel=1e-5)


def test_scaled_moves_its_vertex_by_one() -> None:
    field = np.array([[0, 0.2, 0.1], [0, -0.4, 0]])
    assert scaled(field, 0, UP)[0] == pytest.approx([0, 1, 0.5])
    assert scaled(field, 1, -UP)[1] == pytest.approx([0, -1, 0])
    with pytest.raises(ValueError, match="vertex 1 still"):
        scaled(field * [1, 0, 1], 1, UP)
