"""A seed, a kind and numbers -> what chance says of each of them: always the same, on any machine."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from realizer.arrays import Float64

__all__ = ["uniform"]


def uniform(seed: int, kind: int, k: npt.NDArray[np.int64]) -> Float64:
    """(n,) numbers in [0, 1) that depend on (seed, kind, k) alone; the mixing step of SplitMix64.

    A generator of numpy is not promised to draw the same numbers in its next version.

    Args:
        seed: any whole number.
        kind: what is drawn; two kinds have nothing to do with each other.
        k: (n,) int64, which of its kind.
    """
    mask = (1 << 64) - 1
    z = k.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    z = z + np.uint64((seed * 0xD1B54A32D192ED03 + kind * 0x8CB92BA72F3D8DD7 + 0x632BE59BD9B4E019) & mask)
    for _ in range(2):
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return (z >> np.uint64(11)).astype(np.float64) * 2.0**-53
