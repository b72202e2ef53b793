"""Step 6 of the pipeline: the conversion of AU frames to FAP frames, by piecewise linear functions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import groupby
from typing import TypeAlias

import numpy as np

from realizer import tables
from realizer.animation.axis import axis, mask_channel
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.core.array_types import Bool, Float32, Index
from realizer.tables import AuToFap
from realizer.tables.mappings import Units


@dataclass(frozen=True, eq=False)
class FapMapping:
    """A mapping of AUs to FAPs (Paul 2010, chapter 5)."""

    rows: tuple[AuToFap, ...]  # pieces of the function from each (au, side) of the axis to each FAP
    sources: tuple[str, ...]  # the files that the rows come from; later ones override earlier ones

    @cached_property
    def matrix(self) -> PiecewiseMatrix:
        return PiecewiseMatrix.of(self.rows)

    def replaced(self, units: Units, source: str) -> FapMapping:
        """Return this mapping with the rows of the action units in `units` replaced."""
        kept = (row for row in self.rows if (row.au, row.side) not in units)
        rows = (*kept, *(row for unit in units.values() for row in unit))
        return FapMapping(
            tuple(sorted(rows, key=lambda row: (*row.key, row.au_from))), (*self.sources, source)
        )


@cache
def standard() -> FapMapping:
    return FapMapping(tables.au_to_fap(), ("au_to_fap.csv",))


# The unit and the hinges (see `_hinges`) of a polyline.
Line: TypeAlias = tuple[int, list[tuple[float, float]]]


@dataclass(frozen=True, eq=False)
class Polylines:
    """Piecewise linear functions of AUs, up to k for each FAP: slope * au plus a term for each bend."""

    faps: Index  # (g,) FAP - 1
    # units, slopes: (k, g), (k, g, 1) the unit of each polyline, and its slope at 0
    units: Index
    slopes: Float32
    bent: Index  # (2, b) the indices of the polylines of bends
    # knots, bends: (b, 1) where they are, and the changes of slope
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
    """The rows of a mapping, prepared for whole arrays."""

    # FAP - 1 -> polylines: what raises each FAP; what lowers it, negated; rotations, which add up. A polyline
    # may both raise and lower.
    lines: tuple[Mapping[int, Sequence[Line]], ...]
    closed: Float32  # (68,) float32, the greatest value of each FAP, at which a lid is closed
    mask: Bool  # (68,) True where an AU or speech may use the FAP

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


# Columns (FAP - 1) of upper and lower lid, by side; 1024 is the full aperture (IRISD0).
LIDS = ((18, 20), (19, 21))
APERTURE = 1024.0


def to_fap(frames: AUFrames, mapping: FapMapping | None = None) -> FAPFrames:
    """Convert AU frames to FAP frames; the mask is the same for all frames of one mapping.

    1. The mapping gives a value for each pair of AU and FAP. A FAP gets the strongest positive plus the
       strongest negative one; rotations add up. Pairs of AUs that FACS calls "different" combinations add a
       value of their own.
    2. What opens an eye fades as its upper lid closes, and lids do not pass through each other.
    3. Where speech masks the lips (mask channel "lips"), the values from AUs are reduced by `speech_owns`.
    4. FAPs that do not come from AUs are added, or replace those from AUs as far as they are overridden;
       each FAP is limited to `least`..`most`.

    Without a mapping from AUs to FAPs (`realizer.face.fap_mapping.mapping_of`), it is the built-in one.
    """
    matrix, aus = (mapping or standard()).matrix, frames.moving
    raised, lowered, turned = matrix.evaluate(aus)
    for upper, lower in LIDS:
        if matrix.closed[upper] > 0:
            # What opens the eye fades as its upper lid closes, so that wide eyes can blink.
            lowered[[upper, lower]] *= 1 - np.minimum(raised[upper] / matrix.closed[upper], 1)
    values = raised - lowered + turned
    for unit, other, fap, value in _combinations():
        values[fap] += value * np.minimum(aus[unit], aus[other])
    for upper, lower in LIDS:
        np.minimum(values[lower], APERTURE - values[upper], out=values[lower])
    own, least, most = _limits()
    if (lips := frames.values[:, mask_channel("lips").column]).any():
        values *= 1.0 - own * lips
    if frames.overridden is not None:
        values *= 1.0 - frames.overridden.T
    values += frames.faps.T
    np.maximum(values, least, out=values)
    np.minimum(values, most, out=values)
    # FAPs outside the mapping that a client sets directly belong to the mask too.
    mask = matrix.mask | values.any(axis=1)
    return FAPFrames(frames.times, np.ascontiguousarray(values.T), mask)


@cache
def _limits() -> Float32:
    """Return (3, 68, 1): the part of each FAP that speech owns, its least and its greatest value."""
    limits = [(row.speech_owns, row.least, row.most) for row in tables.faps()]
    return np.array(limits, np.float32).T[:, :, None]


@cache
def _combinations() -> tuple[tuple[int, int, int, float], ...]:
    """Return (unit, other, FAP - 1, value) for each combination; units are columns of the axis."""
    column = {name: target.column for name, target in axis().items()}
    return tuple(
        (column[f"{row.au}{row.side}"], column[f"{row.other}{row.side}"], row.fap - 1, row.value)
        for row in tables.au_combinations()
    )
