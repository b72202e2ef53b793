"""Step 6 of the pipeline: the conversion of AU frames to FAP frames."""

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

# Columns (FAP - 1) of upper and lower lid, by side; 1024 is the full aperture (IRISD0).
LIDS = ((18, 20), (19, 21))
APERTURE = 1024.0


def to_fap(frames: AUFrames, mapping: FapMapping | None = None) -> FAPFrames:
    """Convert AU frames to FAP frames.

    1. The mapping gives a value for each pair of AU and FAP. A FAP gets the strongest positive plus the
       strongest negative one; rotations add up. Pairs of AUs that FACS calls "different" combinations add a
       value of their own.
    2. What opens an eye fades as its upper lid closes, and lids do not pass through each other.
    3. Where speech masks the lips (mask channel "lips"), the values from AUs are reduced by `speech_owns`.
    4. FAPs that do not come from AUs are added, or replace those from AUs as far as they are overridden;
       each FAP is limited to `least`..`most`.

    Args:
        frames: n frames.
        mapping: from AUs to FAPs (`realizer.face.fap_mapping.mapping_of`); None for the built-in one.

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
        # What opens the eye fades as its upper lid closes, so that wide eyes can blink.
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
    # FAPs outside the mapping that a client sets directly belong to the mask too.
    mask = demand.mask.copy()
    if len(plan.beyond):
        mask[plan.faps[plan.beyond]] = values[plan.beyond].any(axis=1)
    whole = np.zeros((68, len(frames.times)), np.float32)
    whole[plan.faps] = values
    return FAPFrames(frames.times, np.ascontiguousarray(whole.T), mask)


@dataclass(frozen=True, eq=False)
class _Plan:
    """The conversion prepared for a set of AUs and FAPs; other attributes than `faps` hold rows of `faps`.

    Attributes:
        asking: the functions from AUs to FAPs.
        faps: (f,) the columns (FAP - 1) that change, those of `asking` first.
        lids: for each eye that may close: the upper lid, the lids that AUs open, and how far it closes.
        combinations: (unit, other, fap, value) of pairs of AUs that add a value of their own.
        gaps: upper and lower lid of each eye.
        given: the FAPs that do not come from AUs.
        beyond: the FAPs outside the mask of the mapping.
        own, least, most: (f, 1) the part that speech owns, least and greatest value.
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


# Sessions repeat a few sets of units; each entry takes 10 kB.
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
    limits = ((row.speech_owns, row.least, row.most) for row in tables.faps())
    own, least, most = np.array(list(limits), np.float32)[faps].T[:, :, None]
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
    """Return (unit, other, FAP - 1, value) for each combination; units are columns of the axis."""
    column = {name: target.column for name, target in axis().items()}
    return tuple(
        (column[f"{row.au}{row.side}"], column[f"{row.other}{row.side}"], row.fap - 1, row.value)
        for row in tables.au_combinations()
    )
