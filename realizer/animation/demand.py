"""Rows of action units and FAPs in, what they ask of whole arrays out: sums of hinges."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import numpy.typing as npt

from realizer import tables
from realizer.animation.targets import axis
from realizer.arrays import Bool, Float32
from realizer.tables import AuToFap

__all__ = ["Demand"]


@dataclass(frozen=True, eq=False)
class Demand:
    """The rows, ready for whole arrays: every polyline is a sum of hinges slope * max(0, au - knot).

    Attributes:
        column, knot, slope: (h,) of each hinge, hinges of one polyline together, polylines sorted by FAP.
        line: (h,) the polyline of each hinge.
        fap: (p,) the column (FAP - 1) of each polyline, rising.
        turns: (68,) True where demands add up: rotations.
        closed: (68,) float32, the most any AU asks of a FAP; what closes a lid.
        mask: (68,) True where an AU or speech may use the FAP.
    """

    column: npt.NDArray[np.intp]
    knot: Float32
    slope: Float32
    line: npt.NDArray[np.intp]
    fap: npt.NDArray[np.intp]
    turns: Bool
    closed: Float32
    mask: Bool

    @classmethod
    def of(cls, rows: Iterable[AuToFap]) -> Demand:
        """From rows on the axis: the pieces of one (au, side, fap) do not overlap and begin at 0."""
        hinges: list[tuple[int, float, float, int]] = []
        faps: list[int] = []
        closed = np.zeros(68, np.float32)
        ordered = sorted(rows, key=lambda row: (row.fap, row.au, row.side, row.au_from))
        for (au, side, fap), pieces in groupby(ordered, key=lambda row: row.key):
            column, slope, end = axis()[f"{au}{side}"].column, 0.0, 0.0
            for piece in pieces:
                if piece.au_from > end and slope:  # level between two pieces
                    hinges.append((column, end, -slope, len(faps)))
                    slope = 0.0
                new = (piece.fap_to - piece.fap_from) / (piece.au_to - piece.au_from)
                hinges.append((column, piece.au_from, new - slope, len(faps)))
                slope, end = new, piece.au_to
                closed[fap - 1] = max(closed[fap - 1], piece.fap_to)
            if end < 1.0:  # level from there on
                hinges.append((column, end, -slope, len(faps)))
            faps.append(fap - 1)
        mask = np.array([row.speech_owns > 0 for row in tables.faps()])
        mask[faps] = True
        of_hinges = np.array(hinges, np.float64).reshape(-1, 4)
        return cls(
            column=of_hinges[:, 0].astype(np.intp),
            knot=of_hinges[:, 1].astype(np.float32),
            slope=of_hinges[:, 2].astype(np.float32),
            line=of_hinges[:, 3].astype(np.intp),
            fap=np.array(faps, np.intp),
            turns=np.array([row.unit == "angle_unit" for row in tables.faps()]),
            closed=closed,
            mask=mask,
        )

    def extremes(self, aus: Float32) -> tuple[Float32, Float32]:
        """The strongest positive and the strongest negative demand, each (68, n), of AUs (n_au, n)."""
        shape = (68, aus.shape[1])
        positive, negative = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        up = np.asarray(aus.any(axis=1), bool)
        live = np.flatnonzero(up[self.column])
        if not len(live):
            return positive, negative
        hinges = self.slope[live, None] * np.maximum(aus[self.column[live]] - self.knot[live, None], 0)
        first = np.flatnonzero(np.diff(self.line[live], prepend=-1))
        asked = np.add.reduceat(hinges, first, axis=0)  # (lines, n)
        faps = self.fap[self.line[live][first]]
        begin = np.flatnonzero(np.diff(faps, prepend=-1))
        which = faps[begin]
        positive[which] = np.maximum(np.maximum.reduceat(asked, begin, axis=0), 0)
        negative[which] = np.minimum(np.minimum.reduceat(asked, begin, axis=0), 0)
        turning = self.turns[which]
        if turning.any():
            positive[which[turning]] = np.add.reduceat(asked, begin, axis=0)[turning]
            negative[which[turning]] = 0
        return positive, negative
