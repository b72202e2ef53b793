"""The rows of parameters that a face's deformer takes, from AU frames."""

from __future__ import annotations

import numpy as np

from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.fap.au_fap_mapping import FapMapping
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32


def poses(frames: AUFrames, inputs: tuple[str, ...], mapping: FapMapping | None = None) -> Float32:
    """What a face is drawn by: stills, films, sheets and streams of pictures and meshes alike.

    A column for each name, in its order: action units as they move a face (0..1), presences (0..1), and FAPs
    in FAPU: those that did not come from action units, and those that the other action units ask for. A face
    that takes no action units gets `to_fap` whole. From a FAP that is held is taken what the action units of
    the face move it by, as far as the mapping knows, so that the face shows the FAP as it is set.

    Args:
        frames: n frames.
        inputs: names of `targets.axis()` (`Face.takes`).
        mapping: what AUs ask of FAPs; None is the one that ships.

    Returns:
        (n, len(takes)) float32.

    Raises:
        KeyError: a name that is not of the axis.
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
