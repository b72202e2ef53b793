"""Conversion of AU frames to the parameters of a face's deformer."""

import numpy as np

from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.fap.au_fap_mapping import FapMapping
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32


def poses(frames: AUFrames, inputs: tuple[str, ...], mapping: FapMapping | None = None) -> Float32:
    """Return the parameters from which a face is drawn, a column for each of `inputs`.

    Action units (0..1) are those that move the face; mask channels are 0..1. FAPs, in FAPU, are those that do
    not come from action units, plus those of action units that are not among `inputs`; without action units
    among them this is `to_fap`. An overridden FAP is reduced by what the face's own action units add to it
    according to the mapping, so that the face shows the FAP as it is set.

    Args:
        frames: n frames.
        inputs: names of `axis()` (`Face.inputs`).
        mapping: from AUs to FAPs; None for the built-in one.

    Returns:
        (n, len(inputs)) float32.

    Raises:
        KeyError: if a name is not in `axis()`.
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
        moved, left = values.copy(), rest.copy()
        moved[:, count : count + 68] = left[:, count : count + 68] = 0
        both = (to_fap(AUFrames(frames.times, one), mapping).values for one in (moved, left))
        values[:, count : count + 68] -= frames.overridden * np.subtract(*both)
    return np.ascontiguousarray(values[:, columns])
