"""The values of steps 5 and 6: sampled AUs, and MPEG-4 FAP frames."""

from __future__ import annotations

from dataclasses import dataclass

from realizer.animation.targets import AU_NAMES
from realizer.arrays import Bool, Float32, Float64, Int32

__all__ = ["AUFrames", "FAPFrames"]


@dataclass(frozen=True, eq=False)
class AUFrames:
    """Every target of the axis, sampled.

    Attributes:
        times: (n,) float64 seconds on the session clock.
        values: (n, n_targets) float32; columns as `animation.targets.axis()`: AUs 0..1, FAPs in FAPU that
            did not come from AUs, presences 0..1.
    """

    times: Float64
    values: Float32

    @property
    def aus(self) -> Float32:
        """(n, n_au) float32, 0..1; columns named by `AU_NAMES()`."""
        return self.values[:, : len(AU_NAMES())]

    @property
    def faps(self) -> Float32:
        """(n, 68) float32 in FAPU: what did not come from AUs (speech, clients); column = FAP - 1."""
        first = len(AU_NAMES())
        return self.values[:, first : first + 68]


@dataclass(frozen=True, eq=False)
class FAPFrames:
    """MPEG-4 facial animation parameters.

    Attributes:
        times: (n,) float64 seconds.
        values: (n, 68) float32 in each FAP's FAPU; column = FAP - 1. FAP 1 and 2 (compound) are 0.
        mask: (68,) bool, True where any frame may use the FAP; FAP 1 and 2 are False.
    """

    times: Float64
    values: Float32
    mask: Bool

    def integers(self) -> Int32:
        """(n, 68) int32: as written to files and sent over the wire (rounded, half to even)."""
        import numpy as np

        return np.rint(self.values).astype(np.int32)
