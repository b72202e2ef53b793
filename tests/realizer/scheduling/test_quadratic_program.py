"""Tests of quadratic programs, against their conditions of optimality."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, triu

from realizer.scheduling.quadratic_program import minimum, symmetric_solution


@pytest.fixture
def positive() -> np.ndarray:
    """Return a positive definite matrix (60, 60) whose values differ by six powers of ten."""
    rng = np.random.default_rng(1)
    factor = np.tril(rng.random((60, 60)) * (rng.random((60, 60)) < 0.1)) * 10 ** rng.uniform(-3, 3, 60)
    return factor @ factor.T + np.diag(10 ** rng.uniform(-3, 3, 60))


def test_symmetric_solution_solves_the_equations_of_the_triangle(positive) -> None:
    upper = triu(positive, format="coo")
    right = np.random.default_rng(2).random(60)
    x = symmetric_solution((upper.row, upper.col), upper.data, right)
    assert abs(positive @ x - right).max() <= 1e-9 * abs(positive @ np.diag(x)).max()


def test_minimum_keeps_to_its_bounds_where_they_push(positive) -> None:
    rng = np.random.default_rng(3)
    linear, bound = rng.standard_normal(60), rng.random(60) - 0.5
    scaled = positive / abs(positive).max() + np.eye(60)
    upper, matrix = csc_array(triu(scaled, format="csc")), csc_array(np.eye(60))
    found = minimum(upper, linear, matrix, bound, in_thread=False, tol_gap_abs=1e-11, tol_gap_rel=1e-11)
    x, z = np.array(found.x), np.array(found.z)
    assert (x <= bound + 1e-8).all()
    assert (z >= -1e-8).all()
    np.testing.assert_allclose(scaled @ x + linear + z, 0, atol=1e-7)
    np.testing.assert_allclose(z * (bound - x), 0, atol=1e-7)
    assert (z > 0.1).any(), "the bounds matter"
