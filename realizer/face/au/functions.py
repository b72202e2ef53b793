"""Density and direction functions of an action unit, and their derivatives (Wojdel 2005, 4.2.3).

Parameters stand in plain arrays: the model evaluates and the fit differentiates the same code.
Coordinates are centimetres from the origin of the motion.
"""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64

GAUSSIAN = 10  # parameters of a Gaussian: height, centre (3), the six of the lower triangular root of B
ANGLE = 19  # parameters of an angle: A1 (6), A2 (3), A3 (6), A4 (3), c
# A symmetric 3 x 3 matrix is written xx, yy, zz, xy, xz, yz; the last three count for both of their places.
LOWER = ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))


def cubic_terms(at: Float64) -> Float64:
    """Return xx, yy, zz, xy, xz, yz (n, 6) of coordinates (n, 3)."""
    x, y, z = at.T
    return np.stack([x * x, y * y, z * z, x * y, x * z, y * z], 1)


def density(parameters: Any, at: Float64) -> tuple[Float64, Float64]:
    """Return the sum of Gaussians (equations 4.6 and 4.7).

    Args:
        parameters: (k, 10): height, centre, root of B (B = root root^T, its lower triangle by rows).
        at: (n, 3) coordinates.

    Returns:
        (n,) the density, in the unit of the heights, and (n, 10 k) its derivatives.
    """
    total = np.zeros(len(at))
    slopes = np.empty((len(at), GAUSSIAN * len(parameters)))
    for k, one in enumerate(np.asarray(parameters, np.float64)):
        root, away, turned, bell = _bell(one, at)
        high = one[0] * bell
        total += high
        mine = slopes[:, GAUSSIAN * k : GAUSSIAN * (k + 1)]
        mine[:, 0] = bell
        mine[:, 1:4] = high[:, None] * (turned @ root.T)
        for column, (i, j) in enumerate(LOWER, 4):
            mine[:, column] = -high * turned[:, j] * away[:, i]
    return total, slopes


def height(parameters: Any, at: Float64) -> Float64:
    """Return the density alone, (n,); arguments as `density`."""
    total = np.zeros(len(at))
    for one in np.asarray(parameters, np.float64):
        total += one[0] * _bell(one, at)[3]
    return total


def _bell(one: Float64, at: Float64) -> tuple[Float64, Float64, Float64, Float64]:
    """Return the root of B, (3, 3); the way from the centre, (n, 3), and in widths; the Gaussian, (n,)."""
    root = np.zeros((3, 3))
    for value, place in zip(one[4:], LOWER, strict=True):
        root[place] = value
    away = at - one[1:4]
    # A Gaussian is zero 40 widths away; farther values would only overflow.
    turned = np.clip(away @ root, -40, 40)
    return root, away, turned, np.exp(-np.einsum("ij,ij->i", turned, turned) / 2)


def angle(parameters: Any, at: Float64) -> tuple[Float64, Float64]:
    """Return a cubic polynomial of the place: quadratic times linear form, both, a constant (4.4, 4.5).

    Returns:
        (n,) radians and (n, 19) its derivatives.
    """
    p = np.asarray(parameters, np.float64)
    squares = cubic_terms(at)
    form, line, value = _cubic(p, squares, at)
    slopes = np.concatenate(
        [squares * line[:, None], at * form[:, None], squares, at, np.ones((len(at), 1))], axis=1
    )
    return value, slopes


def heading(alpha: Any, beta: Any, at: Float64) -> Float64:
    """Return unit vectors (n, 3) at places (n, 3): `angle` and `direction` without derivatives."""
    squares = cubic_terms(at)
    a, b = (_cubic(np.asarray(p, np.float64), squares, at)[2] for p in (alpha, beta))
    level = np.cos(b)
    return np.stack([np.cos(a) * level, np.sin(b), np.sin(a) * level], 1)


def _cubic(p: Float64, squares: Float64, at: Float64) -> tuple[Float64, Float64, Float64]:
    """Return the forms that are multiplied, and the whole polynomial, (n,) each."""
    form, line = squares @ p[:6], at @ p[6:9]
    return form, line, form * line + squares @ p[9:15] + at @ p[15:18] + p[18]


def direction(alpha: Float64, beta: Float64) -> tuple[Float64, Float64, Float64]:
    """Return unit vectors (n, 3) of two angles (equation 4.3), and their derivatives by alpha and by beta."""
    (ca, sa), (cb, sb) = (np.cos(alpha), np.sin(alpha)), (np.cos(beta), np.sin(beta))
    zero = np.zeros_like(ca)
    return (
        np.stack([ca * cb, sb, sa * cb], 1),
        np.stack([-sa * cb, zero, ca * cb], 1),
        np.stack([-ca * sb, cb, -sa * sb], 1),
    )
