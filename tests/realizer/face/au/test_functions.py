"""Tests of density and direction functions and their derivatives."""

import numpy as np
import pytest

from realizer.face.au.functions import angle, density, direction, heading, height

RANDOM = np.random.default_rng(5)
AT = RANDOM.normal(size=(40, 3))
BELLS = RANDOM.normal(size=(3, 10))
ANGLE = RANDOM.normal(size=19) * 0.3


def slopes_of(function, parameters: np.ndarray) -> np.ndarray:
    """Derivatives by central differences, (n, parameters)."""
    columns = []
    for k in range(parameters.size):
        step = np.zeros(parameters.size)
        step[k] = 1e-6
        high, low = (function(parameters + sign * step.reshape(parameters.shape)) for sign in (1, -1))
        columns.append((high - low) / 2e-6)
    return np.stack(columns, 1)


def test_density_is_highest_at_its_centre() -> None:
    bell = np.array([[0.7, 1, 2, 3, 0.5, 0.1, 0.5, -0.2, 0.1, 0.5]])
    there = density(bell, np.array([[1.0, 2, 3], [1.5, 2, 3], [9, 9, 9]]))[0]
    assert there[0] == pytest.approx(0.7)
    assert there[0] > there[1] > there[2]
    assert there[2] < 1e-3


def test_density_falls_as_equation_4_6_says() -> None:
    root = np.array([[0.5, 0, 0], [0.1, 0.6, 0], [-0.2, 0.3, 0.4]])
    bell = np.array([[2.0, 0, 0, 0, 0.5, 0.1, 0.6, -0.2, 0.3, 0.4]])
    form = np.einsum("ni,ij,nj->n", AT, root @ root.T, AT)
    assert density(bell, AT)[0] == pytest.approx(2 * np.exp(-form / 2))


def test_height_and_heading_equal_the_differentiated_functions() -> None:
    assert np.array_equal(height(BELLS, AT), density(BELLS, AT)[0])
    ways = direction(angle(ANGLE, AT)[0], angle(-ANGLE, AT)[0])[0]
    assert np.array_equal(heading(ANGLE, -ANGLE, AT), ways)


def test_density_is_the_sum_of_its_gaussians() -> None:
    alone = sum(density(one[None], AT)[0] for one in BELLS)
    assert density(BELLS, AT)[0] == pytest.approx(alone)


def test_angle_is_the_cubic_of_its_parameters() -> None:
    symmetric = [
        np.array([[p[0], p[3] / 2, p[4] / 2], [p[3] / 2, p[1], p[5] / 2], [p[4] / 2, p[5] / 2, p[2]]])
        for p in (ANGLE[:6], ANGLE[9:15])
    ]
    forms = [np.einsum("ni,ij,nj->n", AT, matrix, AT) for matrix in symmetric]
    wanted = forms[0] * (AT @ ANGLE[6:9]) + forms[1] + AT @ ANGLE[15:18] + ANGLE[18]
    assert angle(ANGLE, AT)[0] == pytest.approx(wanted)


def test_direction_is_a_unit_vector_as_equation_4_3_says() -> None:
    alpha, beta = RANDOM.normal(size=(2, 40)) * 2
    way = direction(alpha, beta)[0]
    assert np.linalg.norm(way, axis=1) == pytest.approx(1)
    assert way[:, 1] == pytest.approx(np.sin(beta))
    assert direction(np.array([np.pi / 2]), np.array([0.0]))[0][0] == pytest.approx([0, 0, 1])


def test_density_and_angle_return_their_derivatives() -> None:
    assert density(BELLS, AT)[1] == pytest.approx(slopes_of(lambda p: density(p, AT)[0], BELLS), abs=1e-6)
    assert angle(ANGLE, AT)[1] == pytest.approx(slopes_of(lambda p: angle(p, AT)[0], ANGLE), abs=1e-6)
    alpha, beta = RANDOM.normal(size=(2, 40))
    way, by_alpha, by_beta = direction(alpha, beta)
    assert by_alpha == pytest.approx((direction(alpha + 1e-6, beta)[0] - way) / 1e-6, abs=1e-5)
    assert by_beta == pytest.approx((direction(alpha, beta + 1e-6)[0] - way) / 1e-6, abs=1e-5)


def test_density_does_not_overflow_far_away() -> None:
    steep = np.array([[1.0, 0, 0, 0, 1e6, 0, 1e6, 0, 0, 1e6]])
    value, slopes = density(steep, np.array([[1e6, 1e6, 1e6]]))
    assert value[0] == 0
    assert np.isfinite(slopes).all()
