"""Smooth random fields in space."""

from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from realizer.core.array_types import Float32

LATTICE = 48  # values along a side, after which the noise repeats
SPREAD = (151 / 315) ** 1.5  # standard deviation of a cubic B-spline over independent unit values


def noise(at: Any, length: Any, seed: int) -> Float32:
    """Return smooth noise (k,) with mean 0 and standard deviation 1 at points (k, 3).

    Args:
        length: metres between independent values, one number or one for each axis.
        seed: the seed of the values.
    """
    rng = np.random.default_rng(seed)
    values: Any = rng.standard_normal((LATTICE,) * 3).astype(np.float32)
    where: Any = np.asarray(at, np.float32).T / np.reshape(np.asarray(length, np.float32), (-1, 1))
    shift = rng.uniform(0, LATTICE, (3, 1)).astype(np.float32)
    out: Any = map_coordinates(values, where + shift, order=3, mode="grid-wrap", prefilter=False)
    return np.asarray(out / np.float32(SPREAD))


def ridges(at: Any, length: Any, seed: int) -> Float32:
    """Return ridged noise (k,), 0..1, which is 1 along thin lines where smooth noise changes its sign."""
    return np.asarray(np.exp(-((noise(at, length, seed) / np.float32(0.3)) ** 2)))
