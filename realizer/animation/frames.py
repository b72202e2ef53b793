"""The values of steps 5 and 6: sampled AUs, and MPEG-4 FAP frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from realizer.animation.cooccurrence import Shown, cooccur
from realizer.animation.targets import AU_NAMES
from realizer.arrays import Bool, Float32, Float64, Int32
from realizer.tables.cooccurrence import Rules

__all__ = ["AUFrames", "FAPFrames"]


@dataclass(frozen=True, eq=False)
class AUFrames:
    """Every target of the axis, sampled.

    Attributes:
        times: (n,) float64 seconds on the session clock.
        values: (n, n_targets) float32; columns as `animation.targets.axis()`: AUs 0..1 as they were asked
            for, FAPs in FAPU that did not come from AUs, presences 0..1.
        rules: which AUs a face can show together; None: all of them.
    """

    times: Float64
    values: Float32
    rules: Rules | None = None

    @property
    def asked(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs before the rules of co-occurrence."""
        return self.values[:, : len(AU_NAMES())]

    @property
    def aus(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs that the face shows; columns named by `AU_NAMES()`."""
        return self.asked if self._shown is None else np.ascontiguousarray(self._shown.aus.T)

    @property
    def moving(self) -> Float32:
        """(n_au, n) float32, 0..1: what moves the face, also where another unit's score covers it."""
        return (
            np.ascontiguousarray(self.asked.T) if self._shown is None else self._shown.aus + self._shown.held
        )

    @cached_property
    def _shown(self) -> Shown | None:
        return None if self.rules is None else cooccur(np.ascontiguousarray(self.asked.T), self.rules)

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
        return np.rint(self.values).astype(np.int32)
