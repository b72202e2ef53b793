"""AUFrames -> FAPFrames: each action unit asks FAPs for something, a mapping says how much."""

from __future__ import annotations

from functools import cache

import numpy as np

from realizer import tables
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.animation.mapping import FapMapping, standard
from realizer.animation.targets import axis, presence
from realizer.arrays import Float32

__all__ = ["to_fap"]

# Columns (FAP - 1) of upper and lower lid, by side; 1024 is the whole aperture (IRISD0).
LIDS = ((18, 20), (19, 21))
APERTURE = 1024.0


def to_fap(frames: AUFrames, mapping: FapMapping | None = None) -> FAPFrames:
    """What a face of MPEG-4 shows.

    1. Each AU asks each FAP for a value (polylines of the mapping). A FAP gets the strongest positive plus
       the strongest negative; rotations add up.
       Two that are a "different" combination in FACS show something more together.
    2. A closing eye lets go of what holds it open, and lids do not pass through each other.
    3. Where speech has the lips (presence "lips"), what AUs ask is taken away by `speech_owns`.
    4. The FAPs that did not come from AUs are added, or, as far as they are held, stand in place of what AUs
       ask; each FAP is limited to `least`..`most`.

    Args:
        frames: n frames.
        mapping: what AUs ask of FAPs (`realizer.mapping.mapping_of`); None is the one that ships.

    Returns:
        n frames; the mask is the same for all frames of one mapping.
    """
    demand = (mapping or standard()).demand
    aus = frames.moving
    positive, negative = demand.extremes(aus)
    _close_lids(positive, negative, demand.closed)
    values = positive + negative
    _combine(values, aus)
    for upper, lower in LIDS:
        values[lower] = np.minimum(values[lower], APERTURE - values[upper])
    own, least, most = _limits()
    lips = frames.values[:, presence("lips").column]
    if lips.any():
        values *= 1.0 - own[:, None] * lips
    if frames.held is not None:
        values *= 1.0 - frames.held.T
    faps = np.clip(values.T + frames.faps, least, most)
    # What a client sets directly counts too, wherever the mapping does not reach.
    mask = demand.mask | faps.any(axis=0)
    return FAPFrames(frames.times, np.ascontiguousarray(faps, np.float32), mask)


def _close_lids(positive: Float32, negative: Float32, closed: Float32) -> None:
    """Take away what holds an eye open as far as its upper lid closes, in place: wide eyes blink shut."""
    for upper, lower in LIDS:
        if closed[upper] > 0 and negative[[upper, lower]].any():
            open_ = 1 - np.minimum(positive[upper] / closed[upper], 1)
            negative[upper] *= open_
            negative[lower] *= open_


def _combine(values: Float32, aus: Float32) -> None:
    """Add what two units show only together, in place: as much of it as the weaker one is there."""
    for unit, other, fap, value in _combinations():
        if aus[unit].any() and aus[other].any():
            values[fap] += value * np.minimum(aus[unit], aus[other])


@cache
def _combinations() -> tuple[tuple[int, int, int, float], ...]:
    """Rows of both units among the AUs, column (FAP - 1), value."""
    column = {name: target.column for name, target in axis().items()}
    return tuple(
        (column[f"{row.au}{row.side}"], column[f"{row.other}{row.side}"], row.fap - 1, row.value)
        for row in tables.au_combinations()
    )


@cache
def _limits() -> tuple[Float32, Float32, Float32]:
    """(68,) each: how much of a FAP speech owns, its least and its most value."""
    rows = tables.faps()
    own, least, most = (
        np.array([getattr(row, name) for row in rows], np.float32)
        for name in ("speech_owns", "least", "most")
    )
    return own, least, most
