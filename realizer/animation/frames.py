"""The values of steps 5 and 6: sampled AUs and MPEG-4 FAP frames."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from realizer.animation.axis import AU_NAMES
from realizer.animation.cooccurrence import Bounds, bounds
from realizer.core.array_types import Bool, Float32, Float64, Int32
from realizer.tables.cooccurrence import Rules


@dataclass(frozen=True, eq=False)
class AUFrames:
    """Every target of the axis, sampled.

    Attributes:
        times: (n,) float64 seconds on the session clock.
        values: (n, n_targets) float32; columns as `animation.targets.axis()`: AUs 0..1 as they were asked
            for, FAPs in FAPU that did not come from AUs, presences 0..1.
        rules: which AUs a face can show together; None: all of them.
        overridden: (n, 68) float32, 0..1: how far a FAP is what `values` say, so that no AU has a say in it;
            None: AUs have theirs everywhere.
        columns: the columns that may be other than 0, rising; None: it is looked up where that is of use.
    """

    times: Float64
    values: Float32
    rules: Rules | None = None
    overridden: Float32 | None = None
    columns: tuple[int, ...] | None = None

    @classmethod
    def concatenate(cls, windows: Sequence[AUFrames]) -> AUFrames:
        """One after the other; at least one, all with the same rules."""
        held = None
        if any(window.overridden is not None for window in windows):
            none = [np.zeros((len(window.times), 68), np.float32) for window in windows]
            held = np.concatenate(
                [n if w.overridden is None else w.overridden for w, n in zip(windows, none, strict=True)]
            )
        columns = None
        if all(window.columns is not None for window in windows):
            columns = tuple(sorted({column for window in windows for column in window.moving_columns}))
        return cls(
            np.concatenate([window.times for window in windows]),
            np.concatenate([window.values for window in windows]),
            windows[0].rules,
            held,
            columns,
        )

    def part(self, first: int, last: int) -> AUFrames:
        """Frames `first` .. `last - 1`."""
        held = None if self.overridden is None else self.overridden[first:last]
        return AUFrames(self.times[first:last], self.values[first:last], self.rules, held, self.columns)

    @cached_property
    def moving_columns(self) -> tuple[int, ...]:
        """The columns that may be other than 0, rising."""
        if self.columns is not None:
            return self.columns
        return tuple(np.flatnonzero(self.values.any(axis=0)).tolist())

    @cached_property
    def moving_aus(self) -> tuple[int, ...]:
        """Those that are AUs."""
        return self.moving_columns[: bisect_left(self.moving_columns, len(AU_NAMES()))]

    @property
    def before_rules(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs before the rules of co-occurrence."""
        return self.values[:, : len(AU_NAMES())]

    @property
    def aus(self) -> Float32:
        """(n, n_au) float32, 0..1: the AUs that the face shows; columns named by `AU_NAMES()`."""
        if self._bounds is None:
            return self.before_rules
        whole = np.zeros((len(self.times), len(AU_NAMES())), np.float32)
        whole[:, self.moving_aus] = self._bounds.scored(self._rows_before_rules, self.moving_rows).T
        return whole

    @property
    def moving(self) -> Float32:
        """(n_au, n) float32, 0..1: what moves the face, also where another unit's score covers it."""
        whole = np.zeros((len(AU_NAMES()), len(self.times)), np.float32)
        whole[list(self.moving_aus)] = self.moving_rows
        return whole

    @cached_property
    def moving_rows(self) -> Float32:
        """(u, n) float32: the rows of `moving` that are `moving_aus`."""
        return (
            self._rows_before_rules if self._bounds is None else self._bounds.moving(self._rows_before_rules)
        )

    @cached_property
    def _rows_before_rules(self) -> Float32:
        return self.values.T.take(self.moving_aus, axis=0)

    @cached_property
    def _bounds(self) -> Bounds | None:
        return None if self.rules is None else bounds(self.rules, self.moving_aus)

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
