"""Channels through keys that start and end at rest."""

from __future__ import annotations

import numpy as np

from realizer.animation.axis import AU_NAMES, Target
from realizer.animation.channel import Channel, Layer
from realizer.core.array_types import Float64

# s; duration of the ease of a track that does not begin or end at rest, at most half of the track.
EASE = 0.12
# The part of its greatest value up to which an end counts as at rest, so that recordings play unchanged.
AT_REST = 0.05


def track(target: Target, times: Float64, values: Float64, source: str) -> Channel:
    """Return a channel with these keys, linear between them; one of a FAP overrides lower layers.

    Args:
        times: (k,) seconds, rising; values: (k,).
    """
    ease = min(EASE, float(times[-1] - times[0]) / 2)
    most = AT_REST * float(np.abs(values).max())
    first, last = abs(float(values[0])), abs(float(values[-1]))
    if first > most and ease > 0:
        times, values = _eased(times, values, ease)
    if last > most and ease > 0:
        back, turned = _eased(-times[::-1], values[::-1], ease)
        times, values = -back[::-1], turned[::-1]
    if not 0 <= target.column - len(AU_NAMES()) < 68 or ease <= 0:
        return Channel(target, times, values, curve="linear", source=source)
    # Its weight eases too, because the face below it may not be at rest.
    ends = np.array([times[0], times[0] + ease, times[-1] - ease, times[-1]])
    keys = np.unique(np.concatenate([times, ends]))
    weight = np.interp(keys, ends, [0.0, 1.0, 1.0, 0.0])
    values = np.interp(keys, times, values)
    return Channel(target, keys, values, curve="linear", layer=Layer.FAPS, weight=weight, source=source)


def _eased(times: Float64, values: Float64, ease: float) -> tuple[Float64, Float64]:
    """Return keys that start at 0 and reach the given curve `ease` seconds later."""
    reached = times[0] + ease
    later = times > reached
    joined = float(np.interp(reached, times, values))
    return (
        np.concatenate([[times[0], reached], times[later]]),
        np.concatenate([[0.0, joined], values[later]]),
    )
