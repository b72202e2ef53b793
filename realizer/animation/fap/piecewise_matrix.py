"""Piecewise linear functions from AUs to FAPs, evaluated as whole arrays."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from typing import TypeAlias

import numpy as np

from realizer import tables
from realizer.animation.axis import axis
from realizer.core.array_types import Bool, Float32, Index
from realizer.tables import AuToFap

# The unit and the hinges (see `_hinges`) of a polyline.
Line: TypeAlias = tuple[int, list[tuple[float, float]]]


@dataclass(frozen=True, eq=False)
class Polylines:
    """Piecewise linear functions of AUs, up to k for each FAP: slope * au plus a term for each bend.

    Attributes:
        faps: (g,) FAP - 1.
        units, slopes: (k, g), (k, g, 1) the unit of each polyline, and its slope at 0.
        bent: (2, b) the indices of the polylines of bends.
        knots, bends: (b, 1) where they are, and the changes of slope.
    """

    faps: Index
    units: Index
    slopes: Float32
    bent: Index
    knots: Float32
    bends: Float32

    @classmethod
    def of(cls, lines: Mapping[int, Sequence[Line]]) -> Polylines:
        """Return the polylines of each FAP - 1."""
        most = max(map(len, lines.values()), default=0)
        units, slopes = np.zeros((most, len(lines)), np.intp), np.zeros((most, len(lines), 1), np.float32)
        bends = []
        for g, own in enumerate(lines.values()):
            for k, (unit, hinges) in enumerate(own):
                units[k, g], slopes[k, g] = unit, sum(slope for knot, slope in hinges if not knot)
                bends += [(k, g, knot, slope) for knot, slope in hinges if knot]
        bent, changes = np.split(np.array(bends, np.float32).reshape(-1, 4).T, 2)
        return cls(np.array(list(lines), np.intp), units, slopes, bent.astype(np.intp), *changes[:, :, None])

    def evaluate(self, aus: Float32, by: np.ufunc) -> Float32:
        """Reduce the functions of AUs (n_au, n) for each FAP, and 0, by a ufunc: (68, n)."""
        values = aus.take(self.units, axis=0)
        values *= self.slopes
        if self.bent.size:
            k, g = self.bent
            np.add.at(values, (k, g), self.bends * np.maximum(aus[self.units[k, g]] - self.knots, 0))
        whole = np.zeros((68, aus.shape[1]), np.float32)
        whole[self.faps] = by.reduce(values, axis=0, initial=0)
        return whole


@dataclass(frozen=True, eq=False)
class PiecewiseMatrix:
    """The rows of a mapping, prepared for whole arrays.

    Attributes:
        lines: FAP - 1 -> polylines: what raises each FAP; what lowers it, negated; rotations, which add up. A
            polyline may both raise and lower.
        closed: (68,) float32, the greatest value of each FAP, at which a lid is closed.
        mask: (68,) True where an AU or speech may use the FAP.
    """

    lines: tuple[Mapping[int, Sequence[Line]], ...]
    closed: Float32
    mask: Bool

    @classmethod
    def of(cls, rows: Iterable[AuToFap]) -> PiecewiseMatrix:
        """Return the matrix of rows; the pieces of one (au, side, fap) begin at 0 and do not overlap."""
        raises, lowers, turns = (defaultdict[int, list[Line]](list) for _ in range(3))
        closed = np.zeros(68, np.float32)
        mask = np.array([row.speech_owns > 0 for row in tables.faps()])
        ordered = sorted(rows, key=lambda row: (row.fap, row.au, row.side, row.au_from))
        for (au, side, fap), group in groupby(ordered, key=lambda row: row.key):
            pieces = list(group)
            hinges, values = _hinges(pieces)
            column = axis()[f"{au}{side}"].column
            closed[fap - 1] = max(closed[fap - 1], *(piece.fap_to for piece in pieces))
            mask[fap - 1] = True
            if tables.faps()[fap - 1].unit == "angle_unit":
                turns[fap - 1].append((column, hinges))
                continue
            if max(values) > 0:
                raises[fap - 1].append((column, hinges))
            if min(values) < 0:
                lowers[fap - 1].append((column, [(knot, -slope) for knot, slope in hinges]))
        return cls((raises, lowers, turns), closed, mask)

    def evaluate(self, aus: Float32) -> tuple[Float32, Float32, Float32]:
        """Return, (68, n) each, how far AUs (n_au, n) raise, lower and turn each FAP.

        Of several AUs the strongest counts; rotations add up.
        """
        raises, lowers, turns = _polylines(self, tuple(np.flatnonzero(aus.any(axis=1)).tolist()))
        return raises.evaluate(aus, np.maximum), lowers.evaluate(aus, np.maximum), turns.evaluate(aus, np.add)


# Sessions repeat a few sets of units.
@lru_cache(maxsize=512)
def _polylines(matrix: PiecewiseMatrix, live: tuple[int, ...]) -> list[Polylines]:
    """Return the polylines of the units that are not 0."""
    every = [
        {fap: [line for line in own if line[0] in live] for fap, own in lines.items()}
        for lines in matrix.lines
    ]
    return [Polylines.of({fap: own for fap, own in lines.items() if own}) for lines in every]


def _hinges(pieces: list[AuToFap]) -> tuple[list[tuple[float, float]], list[float]]:
    """Return (knot, change of slope) of each bend of a polyline, and its values at the knots and at 1."""
    hinges: list[tuple[float, float]] = []
    slope = end = value = 0.0
    values = [0.0]
    for piece in pieces:
        if piece.au_from > end and slope:  # level between two pieces
            hinges.append((end, -slope))
            slope = 0.0
        new = (piece.fap_to - piece.fap_from) / (piece.au_to - piece.au_from)
        hinges.append((piece.au_from, new - slope))
        slope, end = new, piece.au_to
        value += piece.fap_to - piece.fap_from
        values.append(value)
    if end < 1.0:  # level from there on
        hinges.append((end, -slope))
    return hinges, values
