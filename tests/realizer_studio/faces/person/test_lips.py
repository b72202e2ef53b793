"""Tests of the lips."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.person.lips import BORDER, MEET, Lips, close_lips, lip_fields, spline_basis
from realizer_studio.faces.person.makehuman import Figure

pytestmark = pytest.mark.xdist_group("mask")


def test_spline_basis_sums_to_one_and_holds_its_knots() -> None:
    u = np.linspace(-1, 1, 201)
    assert np.allclose(spline_basis(u).sum(axis=0), 1)
    assert np.allclose(spline_basis(np.array([-1, -0.5, 0, 0.5, 1])), np.eye(5), atol=1e-6)


def test_spline_basis_mirrors_and_ends_at_the_corners() -> None:
    u = np.linspace(-1, 1, 41)
    assert np.allclose(spline_basis(u), spline_basis(-u)[::-1])
    assert np.allclose(spline_basis(np.array([-3, 3])), spline_basis(np.array([-1, 1])))


def test_lips_coordinates_are_mirrored_and_bounded(figure: Figure, mask_lips: Lips) -> None:
    twin = figure.mesh.mirror()
    for ring in mask_lips.rings[MEET : BORDER + 1]:
        assert mask_lips.u[ring] == pytest.approx(-mask_lips.u[twin[ring]], abs=1e-6)
    for values in (mask_lips.w, mask_lips.lips, mask_lips.around, np.abs(mask_lips.u)):
        assert values.min() >= 0
        assert values.max() <= 1


def test_lips_end_where_the_red_does(figure: Figure, mask_lips: Lips) -> None:
    assert (mask_lips.lips[mask_lips.rings[BORDER]] == 1).all()
    assert mask_lips.lips[figure.points["9.3"]] == 0
    assert mask_lips.is_upper[figure.points["2.2"]]
    assert not mask_lips.is_upper[figure.points["2.3"]]


def test_close_lips_leaves_a_hair_between_them(figure: Figure) -> None:
    closed = close_lips(figure)
    gap = closed[figure.points["2.2"], 1] - closed[figure.points["2.3"], 1]
    assert gap == pytest.approx(5e-5, abs=1e-6)
    moved = np.flatnonzero((closed != figure.at).any(axis=1))
    assert (np.linalg.norm(figure.at[moved] - figure.point("2.2"), axis=1) < 0.04).all()


def test_lips_measure_the_way_across_by_its_length(figure: Figure, mask_lips: Lips) -> None:
    spoke = [ring[0] for ring in mask_lips.rings[MEET : BORDER + 1]]
    way = np.linalg.norm(np.diff(figure.at[spoke], axis=0), axis=1)
    assert mask_lips.w[spoke] == pytest.approx(np.r_[0, np.cumsum(way) / way.sum()], abs=0.05)


def test_lip_fields_move_their_feature_points_by_one(figure: Figure, mask_lips: Lips) -> None:
    made = lip_fields(figure, mask_lips)
    assert set(made) == {*range(4, 14), 16, 17, 18, *range(51, 61)}
    for fap, name, way in ((4, "2.2", -1), (5, "2.3", 1), (51, "8.1", -1), (57, "8.7", 1), (12, "2.4", 1)):
        assert made[fap][figure.points[name], 1] == pytest.approx(way)


def test_lip_fields_of_equal_faps_move_the_lip_evenly(figure: Figure, mask_lips: Lips) -> None:
    made = lip_fields(figure, mask_lips)
    whole = made[5] + made[10] + made[11] + made[12] + made[13]
    lower = [i for i in mask_lips.rings[MEET] if not mask_lips.is_upper[i] and abs(mask_lips.u[i]) < 0.5]
    assert whole[lower, 1] == pytest.approx(np.ones(len(lower)), abs=0.1)
