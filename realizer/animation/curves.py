"""Sampling of channels: smooth or linear between keys, zero outside."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from realizer.animation.channel import Channel, Crossfade, Gain
from realizer.core.array_types import Float64, Index

Values = TypeVar("Values", Float64, Index)

# From this many keys on, a linear channel (lips: 100 keys a second) is interpolated on its own.
MANY_KEYS = 32


def smooth(u: Float64) -> Float64:
    """The minimum-jerk course from 0 to 1: velocity and acceleration are 0 at both ends.

    Args:
        u: any shape, 0..1, how much of the time has passed.

    Source: Flash & Hogan (1985), in one dimension.
    """
    rest = 6.0 * u
    rest -= 15.0
    rest *= u
    rest += 10.0
    rest *= u * u * u
    return rest


def linear(u: Float64) -> Float64:
    """The straight course from 0 to 1."""
    return u


CURVES: Mapping[str, Callable[[Float64], Float64]] = {"linear": linear, "smooth": smooth}


class Samples(NamedTuple):
    """What channels show where they show anything, end to end: frames of one channel, then of another one.

    Attributes:
        channels: (p,) the channel of each piece; one may have two pieces, of which the later one counts.
        counts: (p,) how many frames it has.
        frames: (e,) which frames they are.
        values: (e,) float64 what is shown there.
    """

    channels: Index
    counts: Index
    frames: Index
    values: Float64

    def spread(self, of_channel: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """(e,) of each value what (m,) has of its channel."""
        return of_channel[self.channels].repeat(self.counts)


def sample(channels: Sequence[Channel], times: Float64) -> Float64:
    """The value of every channel at every time.

    Args:
        channels: m channels.
        times: (n,) seconds, any order.

    Returns:
        (m, n) float64: exactly the key's value at a key, 0 outside the keys (after the last one its value,
        where the channel holds); of two keys at one time the later counts.

    Raises:
        KeyError: a curve that is not in `CURVES`.
    """
    order = in_order(times)
    found = samples(channels, times if order is None else times[order])
    values = np.zeros((len(channels), len(times)))
    frames = found.frames if order is None else order[found.frames]
    values[found.spread(np.arange(len(channels))), frames] = found.values
    return values


def in_order(times: Float64) -> Index | None:
    """(n,) where each of the times (n,) stands once they are sorted; None where they are."""
    return None if (times[1:] >= times[:-1]).all() else np.argsort(times, kind="stable")


def weights(channels: Sequence[Channel], times: Float64) -> Float64:
    """How far every channel takes the place of what lies below: as its `weight` says, times its gains.

    Returns:
        (m, n) float64, 0..1.
    """
    return np.clip(sample([channel.weight_channel for channel in channels], times), 0.0, 1.0)


def samples(channels: Sequence[Channel], times: Float64) -> Samples:
    """As `sample`, where the cost grows with the frames that lie inside keys, not with channels x frames.

    Args:
        channels: m channels.
        times: (n,) seconds, not falling.
    """
    by_curve: dict[str | None, list[int]] = {}  # those of many keys by themselves
    changed: list[int] = []
    for i, channel in enumerate(channels):
        many = channel.curve == "linear" and len(channel.times) >= MANY_KEYS
        by_curve.setdefault(None if many else channel.curve, []).append(i)
        if channel.gains or channel.crossfade is not None or channel.until < np.inf:
            changed.append(i)
    found: list[Samples] = []
    for curve, rows in by_curve.items():
        some = [channels[i] for i in rows]
        if curve is None:
            found.append(_interpolated(np.array(rows), some, times))
        else:
            found.append(_between(np.array(rows), some, times, CURVES[curve]))
    whole = found[0] if len(found) == 1 else _joined(found)
    return _changed(whole, channels, changed, times) if changed else whole


def _joined(parts: Sequence[Samples]) -> Samples:
    none = np.zeros(0, np.intp)
    columns = zip(Samples(none, none, none, np.zeros(0)), *parts, strict=True)
    return Samples(*(np.concatenate(column) for column in columns))


def _interpolated(numbers: Index, channels: Sequence[Channel], times: Float64) -> Samples:
    """Linear channels of many keys: how many there are in all does not matter.

    Those that share the array of their keys, as the lips of a speech do, are worked out together.
    """
    groups: dict[tuple[int, bool], list[int]] = {}
    for i, channel in enumerate(channels):
        groups.setdefault((id(channel.times), channel.keeps_last), []).append(i)
    return _joined([_together(numbers[rows], [channels[i] for i in rows], times) for rows in groups.values()])


def _together(numbers: Index, channels: Sequence[Channel], times: Float64) -> Samples:
    """Linear channels of the same keys."""
    keys, end = channels[0].times, len(channels[0].times) - 1
    first = int(times.searchsorted(keys[0]))
    last = len(times) if channels[0].keeps_last else int(times.searchsorted(keys[-1], "right"))
    before = keys.searchsorted(times[first:last], "right") - 1
    after = np.minimum(before + 1, end)
    length = keys[after] - keys[before]
    length[before == end] = 1.0
    # Of a long speech only what is seen of it.
    seen = slice(before[0], after[-1] + 1) if last > first else slice(0, 0)
    values = np.array([channel.values[seen] for channel in channels])
    at = values.take(before - seen.start, axis=1)
    step = values.take(after - seen.start, axis=1)
    step -= at
    step /= length
    step *= times[first:last] - keys[before]
    at += step
    frames = np.empty(at.shape, np.intp)
    frames[:] = np.arange(first, last)
    return Samples(numbers, np.full(len(channels), last - first), frames.ravel(), at.ravel())


def _ranges(first: Index, counts: Index) -> Index:
    """From each of `first` (k,) on so many whole numbers as `counts` (k,) says, end to end."""
    start = counts.cumsum()
    start -= counts
    np.subtract(first, start, out=start)
    found = start.repeat(counts)
    found += np.arange(len(found))
    return found


def _between(
    numbers: Index, channels: Sequence[Channel], times: Float64, shape: Callable[[Float64], Float64]
) -> Samples:
    """Channels of one curve.

    All segments of all channels are laid end to end. Segment s runs from key s to key s + 1 and holds
    `frames[s]` frames from first[s] on; after a channel's last key a segment without slope follows, with the
    one frame that is exactly there, or all the rest where the channel holds.
    """
    keys = np.concatenate([channel.times for channel in channels])
    value = np.concatenate([channel.values for channel in channels])
    sizes = np.array([len(channel.times) for channel in channels])
    stops = sizes.cumsum()
    ends = stops - 1
    first = times.searchsorted(keys)
    last = times.searchsorted(keys[ends], "right")
    if any(holds := [channel.keeps_last for channel in channels]):
        last[holds] = len(times)
    frames = _steps(first, ends)
    frames[ends] = last - first[ends]
    if frames.min() < 0:  # keys that fall, by a rounding where they were worked out: at one time
        rising = [replace(channel, times=np.maximum.accumulate(channel.times)) for channel in channels]
        return _between(numbers, rising, times, shape)
    length = _steps(keys, ends)
    length[length <= 0.0] = 1.0  # after the last key, and between two at one time, where no frame lies

    frame = _ranges(first, frames)
    passed = times[frame]
    passed -= keys.repeat(frames)
    passed /= length.repeat(frames)
    way = shape(passed)
    way *= _steps(value, ends).repeat(frames)
    way += value.repeat(frames)
    return Samples(numbers, last - first[stops - sizes], frame, way)


def _steps(values: Values, ends: Index) -> Values:
    """(k,) from each of the values (k,) to the next one, 0 at `ends`: the last of each channel."""
    found = np.empty_like(values)
    np.subtract(values[1:], values[:-1], out=found[:-1])
    found[ends] = 0
    return found


def _changed(found: Samples, channels: Sequence[Channel], changed: Sequence[int], times: Float64) -> Samples:
    """With gains, and what the channels `changed` have to do with those before and after them; in place."""
    stops = dict(zip(found.channels.tolist(), found.counts.cumsum().tolist(), strict=True))
    counts = dict(zip(found.channels.tolist(), found.counts.tolist(), strict=True))
    gains: dict[tuple[Gain, ...], Float64] = {}  # what is cut off together has the same
    more = [found]
    for i in changed:
        channel, joint = channels[i], channels[i].crossfade
        part = slice(stops[i] - counts[i], stops[i])
        frames, values = found.frames[part], found.values[part]
        if joint is not None:  # it heals beyond its keys too
            row = np.zeros(len(times))
            row[frames] = values
            values[:] = 0.0
            frames, values = np.arange(len(times)), row
            more.append(Samples(np.array([i]), np.array([len(times)]), frames, values))
        if channel.gains:
            if channel.gains not in gains:
                gains[channel.gains] = gain_at(channel.gains, times)
            values *= gains[channel.gains][frames]
        shown = times[frames]
        if joint is not None:
            values += _healing(joint, shown)
            values[shown < joint.at] = 0.0
        if channel.until < np.inf:
            values[shown >= channel.until] = 0.0
    return found if len(more) == 1 else _joined(more)


def _healing(joint: Crossfade, times: Float64) -> Float64:
    """(n,) what is added so that value and slope go on at the joint; 0 when it has healed."""
    passed = times - joint.at
    left = 1.0 - smooth(np.clip(passed / joint.length, 0.0, 1.0))
    return (joint.value + joint.slope * passed) * left


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
