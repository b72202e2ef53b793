"""Channels and times -> their values: smooth or linear between keys, 0 outside, times the gains they have."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from realizer.animation.channel import Channel, Gain, Joint
from realizer.arrays import Float64

__all__ = ["CURVES", "gain_at", "sample", "smooth", "weights"]

# From this many keys on, a linear channel (lips: 100 keys a second) is interpolated on its own.
MANY_KEYS = 32


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

    The cost grows with the frames that lie inside keys, not with channels x frames.

    Args:
        channels: m channels.
        times: (n,) seconds, any order.

    Returns:
        (m, n) float64: exactly the key's value at a key, 0 outside the keys (after the last one its value,
        where the channel holds); of two keys at one time the later counts.

    Raises:
        KeyError: a curve that is not in `CURVES`.
    """
    order = None if np.all(times[1:] >= times[:-1]) else np.argsort(times, kind="stable")
    if order is not None:
        times = times[order]
    values = np.zeros((len(channels), len(times)))
    by_curve: dict[str, list[int]] = {}
    for i, channel in enumerate(channels):
        if channel.curve == "linear" and len(channel.times) >= MANY_KEYS:
            right = channel.values[-1] if channel.holds else 0.0
            values[i] = np.interp(times, channel.times, channel.values, left=0.0, right=right)
        else:
            by_curve.setdefault(channel.curve, []).append(i)
    for curve, rows in by_curve.items():
        _fill(values, rows, [channels[i] for i in rows], times, CURVES[curve])
    for i, channel in enumerate(channels):
        if channel.gains:
            values[i] *= gain_at(channel.gains, times)
        if channel.joint is not None:
            values[i] += _healing(channel.joint, times)
        _window(values[i], channel, times)
    if order is not None:
        values[:, order] = values.copy()
    return values


def weights(channels: Sequence[Channel], times: Float64) -> Float64:
    """How far every channel takes the place of what lies below: as its `there` says, times its gains.

    Returns:
        (m, n) float64, 0..1.
    """
    return np.clip(sample([channel.share for channel in channels], times), 0.0, 1.0)


def _fill(
    values: Float64,
    rows: Sequence[int],
    channels: Sequence[Channel],
    times: Float64,
    shape: Callable[[Float64], Float64],
) -> None:
    """Write channels of one curve into their rows of `values` (m, n), in place; `times` rise.

    All segments of all channels are laid end to end. Segment s runs from key s to key s + 1 and holds the
    frames first[s] <= frame < last[s]; after a channel's last key a segment without slope follows, with the
    one frame that is exactly there, or all the rest where the channel holds.
    """
    counts = np.array([len(channel.times) for channel in channels])
    keys = np.concatenate([channel.times for channel in channels])
    value = np.concatenate([channel.values for channel in channels])
    ends = np.cumsum(counts) - 1  # of each channel's last key
    holds = np.array([channel.holds for channel in channels])
    first = np.searchsorted(times, keys, side="left")
    last = np.append(first[1:], 0)
    last[ends] = np.where(holds, len(times), np.searchsorted(times, keys[ends], side="right"))
    gap, step = np.diff(keys, append=0.0), np.diff(value, append=0.0)
    gap[ends], step[ends] = 1.0, 0.0
    lengths = np.maximum(last - first, 0)
    gap[gap <= 0.0] = 1.0  # two keys at one time: no frame lies between them

    total = int(lengths.sum())
    segment = np.repeat(np.arange(len(keys)), lengths)
    frame = np.arange(total) - np.repeat(np.cumsum(lengths) - lengths - first, lengths)
    row = np.repeat(np.asarray(rows), counts)
    u = (times[frame] - keys[segment]) / gap[segment]
    values[row[segment], frame] = value[segment] + step[segment] * shape(u)


def _healing(joint: Joint, times: Float64) -> Float64:
    """(n,) what is added so that value and slope go on at the joint; 0 when it has healed."""
    passed = times - joint.at
    left = 1.0 - smooth(np.clip(passed / joint.length, 0.0, 1.0))
    return (joint.value + joint.slope * passed) * left


def _window(row: Float64, channel: Channel, times: Float64) -> None:
    """Take away, in place, what another channel shows."""
    if channel.until < np.inf:
        row[times >= channel.until] = 0.0
    if channel.joint is not None:
        row[times < channel.joint.at] = 0.0


def gain_at(gains: Sequence[Gain], times: Float64) -> Float64:
    """(n,) what something with these gains is multiplied with at times (n,), 1 before the first."""
    if not gains:
        return np.ones(len(times))
    # What has been reached when a gain begins is worked out along with the rest.
    at = np.concatenate([times, [gain.begin for gain in gains]])
    total = np.ones(len(at))
    for n, (begin, end, to, curve) in enumerate(gains):
        reached = total[len(times) + n]
        passed = np.clip((at - begin) / max(end - begin, 1e-9), 0.0, 1.0)  # no length: a step
        total = np.where(at < begin, total, reached + (to - reached) * CURVES[curve](passed))
    return total[: len(times)]
