"""Conversion of AU frames to the parameters of a face's deformer."""

import numpy as np

from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.fap.conversion import FapMapping, to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32


def poses(frames: AUFrames, inputs: tuple[str, ...], mapping: FapMapping | None = None) -> Float32:
    """Return the parameters from which a face is drawn, (n, len(inputs)) float32, for names of `axis()`.

    Action units and mask channels are 0..1, FAPs are in FAPU. Action units that are not among `inputs` are
    converted to FAPs, as in `to_fap`. An overridden FAP is reduced by the effect of the other action units on
    it by the mapping, so that the face shows the value that was set. A name that is not in `axis()` is a
    KeyError.
    """
    columns = [axis()[name].column for name in inputs]
    count = len(AU_NAMES())
    values = frames.values.copy()
    values[:, :count] = frames.moving.T
    rest = values.copy()
    rest[:, [column for column in columns if column < count]] = 0
    values[:, count : count + 68] = to_fap(
        AUFrames(frames.times, rest, overridden=frames.overridden), mapping
    ).values
    if frames.overridden is not None:
        all_units, converted_units = values.copy(), rest.copy()
        all_units[:, count : count + 68] = converted_units[:, count : count + 68] = 0
        faps = (to_fap(AUFrames(frames.times, aus), mapping).values for aus in (all_units, converted_units))
        values[:, count : count + 68] -= frames.overridden * np.subtract(*faps)
    return np.ascontiguousarray(values[:, columns])
