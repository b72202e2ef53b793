"""Piecewise linear functions from AUs to FAPs, evaluated as whole arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.group_reduce import GroupReduction
from realizer.core.array_types import Bool, Float32, Index
from realizer.tables import AuToFap

# The group of a polyline at its FAP: those that raise it, those that lower it, rotations, which add up.
RAISES, LOWERS, TURNS = range(3)


@dataclass(frozen=True, eq=False)
class Breakpoints:
    """The k-th bend of polylines: `lines` (b,), `rows` (b,) of their units, knots and slopes (b, 1)."""

    lines: Index
    rows: Index
    knots: Float32
    slopes: Float32


@dataclass(frozen=True, eq=False)
class PiecewiseMatrix:
    """The rows of a mapping, prepared for whole arrays: a polyline is slope * au plus a term for each bend.

    A polyline that both raises and lowers a FAP occurs twice; those that lower a FAP are negated.

    Attributes:
        column, slope: (p + 1,) the unit of each polyline and its slope at 0; the last polyline is 0.
        side: (p,) 3 * (FAP - 1) + RAISES, LOWERS or TURNS, rising.
        bends: (polyline, number of bends before, knot, change of slope) of each bend.
        closed: (68,) float32, the greatest value of each FAP, at which a lid is closed.
        mask: (68,) True where an AU or speech may use the FAP.
    """

    column: Index
    slope: Float32
    side: Index
    bends: tuple[tuple[int, int, float, float], ...]
    closed: Float32
    mask: Bool

    @classmethod
    def of(cls, rows: Iterable[AuToFap]) -> PiecewiseMatrix:
        """Return the matrix of rows; the pieces of one (au, side, fap) begin at 0 and do not overlap."""
        lines: list[tuple[int, int, list[tuple[float, float]]]] = []
        turns = [row.unit == "angle_unit" for row in tables.faps()]
        closed = np.zeros(68, np.float32)
        mask = np.array([row.speech_owns > 0 for row in tables.faps()])
        ordered = sorted(rows, key=lambda row: (row.fap, row.au, row.side, row.au_from))
        for (au, side, fap), group in groupby(ordered, key=lambda row: row.key):
            pieces = list(group)
            hinges, values = _hinges(pieces)
            column = axis()[f"{au}{side}"].column
            closed[fap - 1] = max(closed[fap - 1], *(piece.fap_to for piece in pieces))
            mask[fap - 1] = True
            if turns[fap - 1]:
                lines.append((3 * (fap - 1) + TURNS, column, hinges))
                continue
            if max(values) > 0:
                lines.append((3 * (fap - 1) + RAISES, column, hinges))
            if min(values) < 0:
                upside_down = [(knot, -slope) for knot, slope in hinges]
                lines.append((3 * (fap - 1) + LOWERS, column, upside_down))
        lines.sort(key=lambda line: line[0])
        starts = [sum(slope for knot, slope in hinges if knot == 0) for _, _, hinges in lines]
        bends = [[hinge for hinge in hinges if hinge[0] > 0] for _, _, hinges in lines]
        return cls(
            column=np.array([*(column for _, column, _ in lines), 0], np.intp),
            slope=np.array([*starts, 0.0], np.float32),
            side=np.array([side for side, _, _ in lines], np.intp),
            bends=tuple((n, k, *hinge) for n, some in enumerate(bends) for k, hinge in enumerate(some)),
            closed=closed,
            mask=mask,
        )

    def among(self, live: tuple[int, ...]) -> AuFapRows:
        """Return the functions of the units in rows `live`, rising; all others must be 0."""
        row = np.full(len(AU_NAMES()), -1)
        row[list(live)] = np.arange(len(live))
        lines = np.flatnonzero(row[self.column[:-1]] >= 0)
        turning = self.side[lines] % 3 == TURNS
        pulls, turns = lines[~turning], lines[turning]
        strongest, sums = GroupReduction.of(self.side[pulls]), GroupReduction.of(self.side[turns])
        # The polyline that is 0 comes between them, for FAPs that no unit raises, or no unit lowers.
        lines = np.concatenate([pulls[strongest.order], [-1], turns[sums.order]])
        none = len(pulls)
        at = dict(zip(strongest.groups.tolist(), range(none), strict=False))
        faps = sorted({side // 3 for side in at})
        return AuFapRows(
            faps=np.array([*faps, *(sums.groups // 3)], np.intp),
            rows=row[self.column[lines]],
            slopes=self.slope[lines][:, None],
            bends=self._bends(lines, row),
            strongest=strongest,
            sums=sums,
            raising=np.array([at.get(3 * fap + RAISES, none) for fap in faps], np.intp),
            lowering=np.array([at.get(3 * fap + LOWERS, none) for fap in faps], np.intp),
            sides=frozenset(at),
        )

    def _bends(self, lines: Index, row: Index) -> tuple[Breakpoints, ...]:
        if not self.bends:
            return ()
        place = {line: i for i, line in enumerate(lines.tolist())}
        found: list[list[tuple[int, int, float, float]]] = []
        for line, before, knot, slope in self.bends:
            if line in place:
                while len(found) <= before:
                    found.append([])
                found[before].append((place[line], int(row[self.column[line]]), knot, slope))
        return tuple(
            Breakpoints(
                np.array([line for line, *_ in some]),
                np.array([unit for _, unit, *_ in some]),
                np.array([knot for *_, knot, _ in some], np.float32)[:, None],
                np.array([slope for *_, slope in some], np.float32)[:, None],
            )
            for some in found
        )


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


@dataclass(frozen=True, eq=False)
class AuFapRows:
    """The functions from some units to FAPs, evaluated as whole arrays.

    Attributes:
        faps: (f,) the columns (FAP - 1) that they move, rotations last.
        rows, slopes: (p,), (p, 1) the unit of each polyline and its slope at 0.
        bends: the first bends of all polylines, the second ones, ...
        strongest, sums: the reductions of polylines that raise or lower, and of rotations.
        raising, lowering: (f - rotations,) the reduced rows that raise and lower each FAP.
        sides: 3 * (FAP - 1) + RAISES or LOWERS of the FAPs that units raise or lower.
    """

    faps: Index
    rows: Index
    slopes: Float32
    bends: tuple[Breakpoints, ...]
    strongest: GroupReduction
    sums: GroupReduction
    raising: Index
    lowering: Index
    sides: frozenset[int]

    def evaluate(self, aus: Float32) -> tuple[Float32, Float32]:
        """Evaluate AUs (u, n).

        Returns:
            (f, n): the greatest value that raises each FAP, or the sum for rotations; (f - rotations, n): the
            greatest value that lowers it.
        """
        if not len(aus):
            none = np.zeros((0, aus.shape[1]), np.float32)
            return none, none
        lines = aus.take(self.rows, axis=0)
        lines *= self.slopes
        for bend in self.bends:
            lines[bend.lines] += bend.slopes * np.maximum(aus[bend.rows] - bend.knots, 0)
        pulls = len(self.strongest.order)
        if self.bends:  # polylines that both raise and lower a FAP occur twice
            np.maximum(lines[:pulls], 0, out=lines[:pulls])
        self.strongest.reduced(lines[:pulls], np.maximum)
        turned = self.sums.reduced(lines[pulls + 1 :], np.add)
        return np.concatenate([lines.take(self.raising, axis=0), turned]), lines.take(self.lowering, axis=0)
