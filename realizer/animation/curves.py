"""Sampling of channels: smooth or linear interpolation between keys, zero outside; crossfades."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from realizer.animation.channel import Channel, Crossfade, Gain
from realizer.core.array_types import Float64, Index

Values = TypeVar("Values", Float64, Index)

# Linear channels with at least this many keys (lips have 100 a second) are interpolated separately.
MANY_KEYS = 32
DURATION = 0.3  # s until a crossfade has ended: about the attack of an expression
TOLERANCE = 1e-9  # s; keys that differ by less are equal but for rounding in the scheduler
STEP = 1e-4  # s over which a slope is measured


def smooth(u: Float64) -> Float64:
    """Return the minimum-jerk curve from 0 to 1, for 0..1: velocity and acceleration are 0 at both ends.

    Source: Flash & Hogan (1985), in one dimension.
    """
    rest = 6.0 * u
    rest -= 15.0
    rest *= u
    rest += 10.0
    rest *= u * u * u
    return rest


CURVES: Mapping[str, Callable[[Float64], Float64]] = {"linear": lambda u: u, "smooth": smooth}


class Samples(NamedTuple):
    """Values of channels in the frames where they are active, concatenated piece by piece."""

    channels: Index  # (p,) the channel of each piece; if one has two pieces, the later one counts
    counts: Index  # (p,) the number of its frames
    frames: Index  # (e,) the frame of each value
    values: Float64  # (e,) float64

    def spread(self, of_channel: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return (e,) for each value the entry of its channel in (m,)."""
        return of_channel[self.channels].repeat(self.counts)


def sample(channels: Sequence[Channel], times: Float64) -> Float64:
    """Return the value of every channel, (m, n) float64, at times (n,) in any order.

    It is exactly the key's value at a key, 0 outside the keys (with `keeps_last`, the last value after them);
    of two keys at one time the later counts.
    """
    order = np.argsort(times, kind="stable")
    found = samples(channels, times[order])
    values = np.zeros((len(channels), len(times)))
    values[found.spread(np.arange(len(channels))), order[found.frames]] = found.values
    return values


def weights(channels: Sequence[Channel], times: Float64) -> Float64:
    """Return the weight of every channel at every time, gains included: (m, n) float64, 0..1."""
    return np.clip(sample([channel.weight_channel for channel in channels], times), 0.0, 1.0)


def samples(channels: Sequence[Channel], times: Float64) -> Samples:
    """Sample channels at a cost that grows with the frames inside their keys, not with channels x frames.

    Times, (n,), must not fall.
    """
    # By curve; linear channels with many keys apart, together if they share their key times, as lips do.
    groups: dict[tuple[str, int, bool], list[int]] = {}
    changed: list[int] = []
    for i, channel in enumerate(channels):
        many = channel.curve == "linear" and len(channel.times) >= MANY_KEYS
        key = ("", id(channel.times), channel.keeps_last) if many else (channel.curve, 0, False)
        groups.setdefault(key, []).append(i)
        if channel.gains or channel.crossfade is not None or channel.until < np.inf:
            changed.append(i)
    found: list[Samples] = []
    for (curve, _, _), rows in groups.items():
        group = [channels[i] for i in rows]
        if curve:
            found.append(_between(np.array(rows), group, times, CURVES[curve]))
        else:
            found.append(_interpolated(np.array(rows), group, times))
    whole = found[0] if len(found) == 1 else _joined(found)
    return _changed(whole, channels, changed, times) if changed else whole


def _joined(parts: Sequence[Samples]) -> Samples:
    none = np.zeros(0, np.intp)
    columns = zip(Samples(none, none, none, np.zeros(0)), *parts, strict=True)
    return Samples(*(np.concatenate(column) for column in columns))


def _interpolated(numbers: Index, channels: Sequence[Channel], times: Float64) -> Samples:
    """Sample linear channels with the same many key times at a cost independent of their number."""
    keys = channels[0].times
    first = int(times.searchsorted(keys[0]))
    last = len(times) if channels[0].keeps_last else int(times.searchsorted(keys[-1], "right"))
    values = np.array([np.interp(times[first:last], keys, channel.values) for channel in channels])
    frames = np.tile(np.arange(first, last), len(channels))
    return Samples(numbers, np.full(len(channels), last - first), frames, values.ravel())


def _ranges(first: Index, counts: Index) -> Index:
    """Return `counts` (k,) consecutive integers from each of `first` (k,) on, concatenated."""
    start = counts.cumsum()
    start -= counts
    np.subtract(first, start, out=start)
    found = start.repeat(counts)
    found += np.arange(len(found))
    return found


def _between(
    numbers: Index, channels: Sequence[Channel], times: Float64, shape: Callable[[Float64], Float64]
) -> Samples:
    """Sample channels with the same curve.

    The segments of all channels are concatenated. Segment s runs from key s to key s + 1 and has `frames[s]`
    frames from first[s] on. A constant segment follows a channel's last key: with a frame exactly at the
    key, or with all the rest if the channel keeps its last value.
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
    if frames.min() < 0:  # key times that fall by a rounding error are made equal
        rising = [replace(channel, times=np.maximum.accumulate(channel.times)) for channel in channels]
        return _between(numbers, rising, times, shape)
    length = _steps(keys, ends)
    length[length <= 0.0] = 1.0  # after the last key, and between keys at one time, which have no frames

    frame = _ranges(first, frames)
    passed = times[frame]
    passed -= keys.repeat(frames)
    passed /= length.repeat(frames)
    way = shape(passed)
    way *= _steps(value, ends).repeat(frames)
    way += value.repeat(frames)
    return Samples(numbers, last - first[stops - sizes], frame, way)


def _steps(values: Values, ends: Index) -> Values:
    """Return the differences (k,) from each value to the next one; 0 at `ends`, the last of each channel."""
    found = np.empty_like(values)
    np.subtract(values[1:], values[:-1], out=found[:-1])
    found[ends] = 0
    return found


def _changed(found: Samples, channels: Sequence[Channel], changed: Sequence[int], times: Float64) -> Samples:
    """Apply gains, crossfades and ends to the channels `changed`, in place where possible."""
    stops = dict(zip(found.channels.tolist(), found.counts.cumsum().tolist(), strict=True))
    counts = dict(zip(found.channels.tolist(), found.counts.tolist(), strict=True))
    gains: dict[tuple[Gain, ...], Float64] = {}  # channels of one behaviour usually share theirs
    more = [found]
    for i in changed:
        channel, crossfade = channels[i], channels[i].crossfade
        part = slice(stops[i] - counts[i], stops[i])
        frames, values = found.frames[part], found.values[part]
        if crossfade is not None:  # a crossfade may last beyond the keys
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
        if crossfade is not None:
            values += _correction(crossfade, shown)
            values[shown < crossfade.at] = 0.0
        if channel.until < np.inf:
            values[shown >= channel.until] = 0.0
    return found if len(more) == 1 else _joined(more)


def _correction(crossfade: Crossfade, times: Float64) -> Float64:
    """Return the correction (n,) that makes value and slope continuous at the crossfade; 0 after its end."""
    passed = times - crossfade.at
    left = 1.0 - smooth(np.clip(passed / crossfade.length, 0.0, 1.0))
    return (crossfade.value + crossfade.slope * passed) * left


def gain_at(gains: Sequence[Gain], times: Float64) -> Float64:
    """Return the factor (n,) of gains at times (n,); 1 before the first."""
    if not gains:
        return np.ones(len(times))
    # The factor reached when each gain begins is computed along with those at `times`.
    at = np.concatenate([times, [gain.begin for gain in gains]])
    total = np.ones(len(at))
    for n, (begin, end, to, curve) in enumerate(gains):
        reached = total[len(times) + n]
        passed = np.clip((at - begin) / max(end - begin, 1e-9), 0.0, 1.0)  # no length: a step
        total = np.where(at < begin, total, reached + (to - reached) * CURVES[curve](passed))
    return total[: len(times)]


def crossfade(old: Sequence[Channel], new: Sequence[Channel], now: float) -> tuple[Channel, ...]:
    """Replace channels at `now` without a jump in value or velocity, and return all channels.

    Of the old channels, those that were replaced before stay as they are; the new ones, of the same behaviour
    at other times, inherit their gains.
    """
    kept = [c for c in old if c.until < float("inf")]
    playing = [c for c in old if c.until == float("inf")]
    # When a speech grows, most of its channels stay equal.
    comparable = {(id(c.values), c.target): c for c in playing if c.crossfade is None and not c.gains}
    unchanged: set[int] = set()
    pending: list[Channel] = []
    for channel in new:
        previous = comparable.get((id(channel.values), channel.target))
        if previous is not None and np.abs(previous.times - channel.times).max() < TOLERANCE:
            unchanged.add(id(previous))
        else:
            pending.append(channel)
    kept += [c for c in playing if id(c) in unchanged]
    playing = [c for c in playing if id(c) not in unchanged]
    pairs = [(c, _twin(c, n, playing, pending)) for n, c in enumerate(playing)]
    follow = [(c, replace(twin, gains=c.gains)) for c, twin in pairs if twin is not None]
    unmatched = [c.faded(now, now + DURATION) for c, twin in pairs if twin is None]
    matched = {id(twin) for _, twin in pairs}
    fresh = [c for c in pending if id(c) not in matched]
    if not follow:
        return (*kept, *unmatched, *fresh)
    before, after = (list(side) for side in zip(*follow, strict=True))
    shown = sample([*before, *after], np.array([now, now + STEP])).reshape(2, len(follow), 2)
    value, ahead = (shown[0] - shown[1]).T
    present = weights([*before, *after], np.array([now])).reshape(2, len(follow))
    continued = [
        replace(c, crossfade=Crossfade(now, float(v), float((a - v) / STEP), DURATION, float(share)))
        for c, v, a, share in zip(after, value, ahead, present[0] - present[1], strict=True)
    ]
    return (*kept, *(replace(c, until=now) for c in before), *continued, *unmatched, *fresh)


def _twin(channel: Channel, n: int, old: Sequence[Channel], new: Sequence[Channel]) -> Channel | None:
    """Return the new channel with the same target and the same rank among those of this target."""
    place = sum(c.target == channel.target for c in old[:n])
    same = [c for c in new if c.target == channel.target]
    return same[place] if place < len(same) else None
