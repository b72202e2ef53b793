"""AUFrames -> FAPFrames: each action unit asks FAPs for something, the table says how much."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby

import numpy as np
import numpy.typing as npt

from realizer import tables
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.animation.targets import axis, presence
from realizer.arrays import Bool, Float32
from realizer.tables import AuToFap

__all__ = ["to_fap"]

# Columns (FAP - 1) of upper and lower lid, by side; 1024 is the whole aperture (IRISD0).
LIDS = ((18, 20), (19, 21))
APERTURE = 1024.0


def to_fap(frames: AUFrames, rows: tuple[AuToFap, ...] | None = None) -> FAPFrames:
    """What a face of MPEG-4 shows.

    1. Each AU asks each FAP for a value (polylines of the table). A FAP gets the strongest positive plus
       the strongest negative; rotations add up.
    2. A closing eye lets go of what holds it open, and lids do not pass through each other.
    3. Where speech has the lips (presence "lips"), what AUs ask is taken away by `speech_owns`.
    4. The FAPs that did not come from AUs are added; each FAP is limited to `least`..`most`.

    Args:
        frames: n frames.
        rows: the table, with a face's own rows (`tables.override`); None for the table itself.

    Returns:
        n frames; the mask is the same for all frames of one table.
    """
    demand = _compile(rows)
    aus = frames.moving
    positive, negative = demand.extremes(aus)
    _close_lids(positive, negative, demand.closed)
    values = positive + negative
    for upper, lower in LIDS:
        values[lower] = np.minimum(values[lower], APERTURE - values[upper])
    own, least, most = _limits()
    lips = frames.values[:, presence("lips").column]
    if lips.any():
        values *= 1.0 - own[:, None] * lips
    faps = np.clip(values.T + frames.faps, least, most)
    # What a client sets directly counts too, wherever the table does not reach.
    mask = demand.mask | faps.any(axis=0)
    return FAPFrames(frames.times, np.ascontiguousarray(faps, np.float32), mask)


@dataclass(frozen=True, eq=False)
class Demand:
    """The table, ready for whole arrays: every polyline is a sum of hinges slope * max(0, au - knot).

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


def _close_lids(positive: Float32, negative: Float32, closed: Float32) -> None:
    """Take away what holds an eye open as far as its upper lid closes, in place: wide eyes blink shut."""
    for upper, lower in LIDS:
        if closed[upper] > 0 and negative[[upper, lower]].any():
            open_ = 1 - np.minimum(positive[upper] / closed[upper], 1)
            negative[upper] *= open_
            negative[lower] *= open_


@lru_cache(maxsize=16)
def _compile(rows: tuple[AuToFap, ...] | None) -> Demand:
    if rows is None:
        rows = tables.au_to_fap()
    units = [row.unit for row in tables.faps()]
    speech_owns = np.array([row.speech_owns for row in tables.faps()])
    hinges: list[tuple[int, float, float, int]] = []
    faps: list[int] = []
    closed = np.zeros(68, np.float32)
    ordered = sorted(rows, key=lambda row: (row.fap, row.au, row.side, row.au_from))
    for (au, side, fap), group in groupby(ordered, key=lambda row: row.key):
        pieces = list(group)
        slope = 0.0
        for piece in pieces:
            new = (piece.fap_to - piece.fap_from) / (piece.au_to - piece.au_from)
            hinges.append((axis()[f"{au}{side}"].column, piece.au_from, new - slope, len(faps)))
            slope = new
        if pieces[-1].au_to < 1.0:  # level from there on
            hinges.append((axis()[f"{au}{side}"].column, pieces[-1].au_to, -slope, len(faps)))
        faps.append(fap - 1)
        closed[fap - 1] = max(closed[fap - 1], *(piece.fap_to for piece in pieces))
    column, knot, slopes, line = zip(*hinges, strict=True)
    mask = speech_owns > 0
    mask[faps] = True
    return Demand(
        np.array(column, np.intp),
        np.array(knot, np.float32),
        np.array(slopes, np.float32),
        np.array(line, np.intp),
        np.array(faps, np.intp),
        np.array([unit == "angle_unit" for unit in units]),
        closed,
        mask,
    )


@lru_cache(maxsize=1)
def _limits() -> tuple[Float32, Float32, Float32]:
    """(68,) each: how much of a FAP speech owns, its least and its most value."""
    rows = tables.faps()
    own, least, most = (
        np.array([getattr(row, name) for row in rows], np.float32)
        for name in ("speech_owns", "least", "most")
    )
    return own, least, most
