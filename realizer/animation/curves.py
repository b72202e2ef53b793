"""Channels and times -> their values: smooth or linear between keys, 0 outside, faded where they are cut off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby

import numpy as np

from realizer.animation.channel import Channel
from realizer.arrays import Float64

__all__ = ["CURVES", "sample", "smooth", "weights"]

# Up to this many keys all channels of a kind are looked up together; beyond it, one by one.
FEW_KEYS = 12


def smooth(u: Float64) -> Float64:
    """The minimum-jerk course from 0 to 1: velocity and acceleration are 0 at both ends.

    Args:
        u: any shape, 0..1, how much of the time has passed.

    Source: Flash & Hogan (1985), in one dimension.
    """
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def linear(u: Float64) -> Float64:
    """The straight course from 0 to 1."""
    return u


CURVES: Mapping[str, Callable[[Float64], Float64]] = {"linear": linear, "smooth": smooth}


def sample(channels: Sequence[Channel], times: Float64) -> Float64:
    """The value of every channel at every time.

    Channels with the same curve and number of keys are sampled in one go: 100 channels at 250 times
    take about half a millisecond.

    Args:
        channels: m channels.
        times: (n,) seconds, any order.

    Returns:
        (m, n) float64: exactly the key's value at a key, 0 outside the keys (after the last one its value,
        where the channel holds); of two keys at one time the later counts.

    Raises:
        KeyError: a curve that is not in `CURVES`.
    """
    values = np.zeros((len(channels), len(times)))
    order = sorted(range(len(channels)), key=lambda i: _form(channels[i]))
    for (curve, keys), group in groupby(order, key=lambda i: _form(channels[i])):
        rows = list(group)
        shape = CURVES[curve]
        if keys <= FEW_KEYS:
            values[rows] = _few([channels[i] for i in rows], times, shape)
        else:
            for i in rows:
                values[i] = _many(channels[i], times, shape)
    fading = [i for i, channel in enumerate(channels) if channel.fade is not None]
    if fading:
        values[fading] *= _fade([channels[i] for i in fading], times)
    return values


def weights(channels: Sequence[Channel], times: Float64) -> Float64:
    """How much of every channel is there: 1 from its first key to its last (for ever where it holds), less
    where it is faded, 0 outside.

    Returns:
        (m, n) float64, 0..1.
    """
    first, last = np.array([channel.span for channel in channels]).reshape(-1, 2).T[..., None]
    there = ((times >= first) & (times <= last)).astype(np.float64)
    fading = [i for i, channel in enumerate(channels) if channel.fade is not None]
    if fading:
        there[fading] *= _fade([channels[i] for i in fading], times)
    return there


def _form(channel: Channel) -> tuple[str, int]:
    return channel.curve, len(channel.times)


def _few(channels: Sequence[Channel], times: Float64, shape: Callable[[Float64], Float64]) -> Float64:
    """(m, n) values of channels that have the same number of keys k: every time is compared with every key."""
    keys = np.stack([channel.times for channel in channels])  # (m, k)
    values = np.stack([channel.values for channel in channels])
    holds = np.array([channel.holds for channel in channels])
    # Number of keys that are not later than each time, 0..k.
    passed = (times[None, None, :] >= keys[:, :, None]).sum(axis=1, dtype=np.intp)
    last = keys.shape[1] - 1
    left = np.clip(passed - 1, 0, last)
    right = np.minimum(left + 1, last)
    from_time, from_value = np.take_along_axis(keys, left, 1), np.take_along_axis(values, left, 1)
    gap = np.take_along_axis(keys, right, 1) - from_time
    step = np.take_along_axis(values, right, 1) - from_value
    gap[gap <= 0.0] = 1.0  # the last key, or two keys at one time: step is 0, or never looked up
    sampled: Float64 = from_value + step * shape((times - from_time) / gap)
    past = (passed > last) & (times > keys[:, -1:])
    sampled[past] = np.broadcast_to(np.where(holds, values[:, -1], 0.0)[:, None], past.shape)[past]
    sampled[passed == 0] = 0.0
    return sampled


def _many(channel: Channel, times: Float64, shape: Callable[[Float64], Float64]) -> Float64:
    """(n,) values of one channel: a binary search for each time."""
    keys, values = channel.times, channel.values
    passed = np.searchsorted(keys, times, side="right")
    left = np.clip(passed - 1, 0, len(keys) - 1)
    right = np.minimum(left + 1, len(keys) - 1)
    gap = keys[right] - keys[left]
    gap[gap <= 0.0] = 1.0
    sampled: Float64 = values[left] + (values[right] - values[left]) * shape((times - keys[left]) / gap)
    sampled[times > keys[-1]] = values[-1] if channel.holds else 0.0
    sampled[passed == 0] = 0.0
    return sampled


def _fade(channels: Sequence[Channel], times: Float64) -> Float64:
    """(m, n) envelope of channels that fade: 1 until `begin`, smoothly to 0 at `end`."""
    begin, end = np.array([channel.fade for channel in channels], np.float64).T[..., None]
    length = np.maximum(end - begin, 1e-9)  # s; a fade without length is a step
    return 1.0 - smooth(np.clip((times - begin) / length, 0.0, 1.0))
