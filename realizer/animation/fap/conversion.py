"""Step 6 of the pipeline: the conversion of AU frames to FAP frames."""

from functools import cache

import numpy as np

from realizer import tables
from realizer.animation.axis import axis, mask_channel
from realizer.animation.fap.au_fap_mapping import FapMapping, standard
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.core.array_types import Float32

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
