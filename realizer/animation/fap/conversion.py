"""Step 6, the conversion of AU frames to FAP frames."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, axis, mask_channel
from realizer.animation.fap.au_fap_mapping import FapMapping, standard
from realizer.animation.fap.piecewise_matrix import LOWERS, RAISES, AuFapRows, PiecewiseMatrix
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.core.array_types import Float32, Index

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
        mapping: what AUs ask of FAPs (`realizer.face.fap_mapping.mapping_of`); None is the one that ships.

    Returns:
        n frames; the mask is the same for all frames of one mapping.
    """
    count = len(AU_NAMES())
    live = frames.moving_columns
    given = tuple(column - count for column in live if count <= column < count + 68)
    demand = (mapping or standard()).matrix
    plan = _plan(demand, frames.moving_aus, given)
    aus = frames.moving_rows
    raised, lowered = plan.asking.evaluate(aus)
    values = np.zeros((len(plan.faps), len(frames.times)), np.float32)
    values[: len(raised)] = raised
    for upper, lids, closed in plan.lids:
        # What holds an eye open goes as far as its upper lid closes: wide eyes blink shut.
        left = 1 - np.minimum(raised[upper] / closed, 1)
        for lid in lids:
            lowered[lid] *= left
    values[: len(lowered)] -= lowered
    for unit, other, fap, value in plan.combinations:
        values[fap] += value * np.minimum(aus[unit], aus[other])
    for upper, lower in plan.gaps:
        np.minimum(values[lower], APERTURE - values[upper], out=values[lower])
    if (lips := mask_channel("lips").column) in live:
        values *= 1.0 - plan.own * frames.values[:, lips]
    if frames.overridden is not None:
        values *= 1.0 - frames.overridden.T[plan.faps]
    if given:
        values[plan.given] += frames.faps.T[list(given)]
    np.maximum(values, plan.least, out=values)
    np.minimum(values, plan.most, out=values)
    # What a client sets directly counts too, wherever the mapping does not reach.
    mask = demand.mask.copy()
    if len(plan.beyond):
        mask[plan.faps[plan.beyond]] = values[plan.beyond].any(axis=1)
    whole = np.zeros((68, len(frames.times)), np.float32)
    whole[plan.faps] = values
    return FAPFrames(frames.times, np.ascontiguousarray(whole.T), mask)


@dataclass(frozen=True, eq=False)
class _Plan:
    """What there is to do for some action units and FAPs: rows of arrays, and rows of those.

    Attributes:
        asking: what the units ask.
        faps: (f,) the columns (FAP - 1) that change, those of `asking` first.
        lids: of each eye that may close: the upper lid, what holds lids open, and how far that lid closes.
        combinations: two units, and the FAP that they move more together, by how much.
        gaps: upper and lower lid of each eye.
        given: the FAPs that did not come from action units.
        beyond: the FAPs that are not in the mask of the mapping.
        own, least, most: (f, 1) how much of a FAP speech owns, its least and its most value.
    """

    asking: AuFapRows
    faps: Index
    lids: tuple[tuple[int, list[int], np.float32], ...]
    combinations: tuple[tuple[int, int, int, float], ...]
    gaps: tuple[tuple[int, int], ...]
    given: Index
    beyond: Index
    own: Float32
    least: Float32
    most: Float32


# Sessions move the same few sets of units again and again; 10 kB each.
@lru_cache(maxsize=512)
def _plan(demand: PiecewiseMatrix, live: tuple[int, ...], given: tuple[int, ...]) -> _Plan:
    asking = demand.among(live)
    unit = {column: row for row, column in enumerate(live)}
    together = [row for row in _combinations() if row[0] in unit and row[1] in unit]
    moved = {*asking.faps.tolist(), *given, *(fap for *_, fap, _ in together)}
    eyes = [pair for pair in LIDS if not moved.isdisjoint(pair)]
    moved |= {lid for pair in eyes for lid in pair}
    faps = [*asking.faps.tolist(), *sorted(moved - {*asking.faps.tolist()})]
    row = {fap: k for k, fap in enumerate(faps)}
    own, least, most = (limit[faps][:, None] for limit in _limits())
    return _Plan(
        asking=asking,
        faps=np.array(faps, np.intp),
        lids=tuple(
            (row[pair[0]], lids, demand.closed[pair[0]])
            for pair in eyes
            if demand.closed[pair[0]] > 0
            and 3 * pair[0] + RAISES in asking.sides
            and (lids := [row[lid] for lid in pair if 3 * lid + LOWERS in asking.sides])
        ),
        combinations=tuple((unit[one], unit[other], row[fap], value) for one, other, fap, value in together),
        gaps=tuple((row[upper], row[lower]) for upper, lower in eyes),
        given=np.array([row[fap] for fap in given], np.intp),
        beyond=np.array([row[fap] for fap in faps if not demand.mask[fap]], np.intp),
        own=own,
        least=least,
        most=most,
    )


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
