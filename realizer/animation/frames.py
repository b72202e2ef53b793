"""Frames, the results of steps 5 and 6: sampled AUs and MPEG-4 FAPs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from realizer.animation.axis import AU_NAMES
from realizer.animation.cooccurrence import bounds
from realizer.core.array_types import Bool, Float32, Float64, Int32
from realizer.tables.cooccurrence import Rules


@dataclass(frozen=True, eq=False)
class AUFrames:
    """Sampled values of every target of the axis."""

    times: Float64  # (n,) float64 seconds on the session clock
    # (n, n_targets) float32; columns as `animation.axis.axis()`: AUs 0..1 as requested, FAPs in FAPU that do
    # not come from AUs, mask channels 0..1
    values: Float32
    rules: Rules | None = None  # co-occurrence rules; None for none
    # (n, 68) float32, 0..1: how far AUs do not contribute to a FAP; None for 0 everywhere
    overridden: Float32 | None = None

    @classmethod
    def concatenate(cls, windows: Sequence[AUFrames]) -> AUFrames:
        """Join windows, at least one, which all have the same rules."""
        overridden = None
        if any(window.overridden is not None for window in windows):
            none = [np.zeros((len(window.times), 68), np.float32) for window in windows]
            overridden = np.concatenate(
                [n if w.overridden is None else w.overridden for w, n in zip(windows, none, strict=True)]
            )
        return cls(
            np.concatenate([window.times for window in windows]),
            np.concatenate([window.values for window in windows]),
            windows[0].rules,
            overridden,
        )

    def part(self, first: int, last: int) -> AUFrames:
        overridden = None if self.overridden is None else self.overridden[first:last]
        return AUFrames(self.times[first:last], self.values[first:last], self.rules, overridden)

    @property
    def before_rules(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs before the co-occurrence rules."""
        return self.values[:, : len(AU_NAMES())]

    @property
    def aus(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs that the face shows; columns named by `AU_NAMES()`."""
        if self.rules is None:
            return self.before_rules
        return bounds(self.rules).scored(self.before_rules.T, self.moving).T

    @cached_property
    def moving(self) -> Float32:
        """(n_au, n) float32, 0..1: the AUs that move the face, scored by a FACS coder or not."""
        requested = self.before_rules.T
        return requested if self.rules is None else bounds(self.rules).moving(requested)

    @property
    def faps(self) -> Float32:
        """(n, 68) float32 in FAPU: FAPs that do not come from AUs (speech, clients); column = FAP - 1."""
        first = len(AU_NAMES())
        return self.values[:, first : first + 68]


@dataclass(frozen=True, eq=False)
class FAPFrames:
    """MPEG-4 facial animation parameters."""

    times: Float64  # (n,) float64 seconds
    values: Float32  # (n, 68) float32 in each FAP's FAPU; column = FAP - 1. FAP 1 and 2 (compound) are 0.
    mask: Bool  # (68,) bool, True where any frame may use the FAP; FAP 1 and 2 are False

    def integers(self) -> Int32:
        """Return the values rounded (half to even), as files and streams hold them: (n, 68) int32."""
        return np.rint(self.values).astype(np.int32)
