"""Random numbers that depend on seed, kind and index alone, and are the same on any machine."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Float64


def uniform(seed: int, kind: int | Sequence[int], k: npt.NDArray[np.int64]) -> Float64:
    """Return numbers in [0, 1) that depend on (seed, kind, k) alone, by the mixing step of SplitMix64.

    Generators of numpy may draw other numbers in its next version. Numbers of different kinds, which are
    purposes, are independent; several kinds, (m,), cost little more than one. For indices k, (n,), there are
    (n,) numbers, or (m, n) of several kinds.
    """
    begins = [_begin(seed, one) for one in ([kind] if isinstance(kind, int) else kind)]
    z = k.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + np.array(begins, np.uint64)[:, None]
    for _ in range(2):
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    drawn: Float64 = (z >> np.uint64(11)).astype(np.float64) * 2.0**-53
    return drawn[0] if isinstance(kind, int) else drawn


def _begin(seed: int, kind: int) -> int:
    return (seed * 0xD1B54A32D192ED03 + kind * 0x8CB92BA72F3D8DD7 + 0x632BE59BD9B4E019) & ((1 << 64) - 1)
