"""Tests of the lips' splines."""

from __future__ import annotations

import numpy as np

from realizer.facebuild.person.lips import spline_basis


def test_the_lips_splines_sum_to_one_and_hold_their_knots() -> None:
    u = np.linspace(-1, 1, 201)
    assert np.allclose(spline_basis(u).sum(axis=0), 1)
    assert np.allclose(spline_basis(np.array([-1, -0.5, 0, 0.5, 1])), np.eye(5), atol=1e-6)


def test_the_lips_splines_mirror_and_end_at_the_corners() -> None:
    u = np.linspace(-1, 1, 41)
    assert np.allclose(spline_basis(u), spline_basis(-u)[::-1])
    assert np.allclose(spline_basis(np.array([-3, 3])), spline_basis(np.array([-1, 1])))
