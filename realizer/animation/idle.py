"""A seed and a span of time -> what a face does when it does nothing: blinks, small head motion, saccades.

Everything is a function of (seed, time) alone: each movement has a number k = 0, 1, 2, .. and draws what is
random about it from (seed, kind, k), so any two windows of time agree where they overlap.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.chance import uniform
from realizer.animation.channel import Channel
from realizer.animation.curves import smooth
from realizer.animation.targets import au
from realizer.arrays import Float64, Index
from realizer.speech.accents import prosody_facts

__all__ = ["Blinks", "Fewer", "Idle", "Motion", "PhraseEnd", "idle_face"]

# s between two blinks: log-normal, as measured inter-blink times are; its median and limits are ours.
BLINK_MEDIAN, BLINK_SPREAD, BLINK_LEAST, BLINK_MOST = 3.8, 0.3, 2.5, 6.0
# s: a lid closes faster than it opens; 0.05 s shut is at least one frame at 25 fps. 0.3 s in all.
BLINK_TIMES = np.array([0.0, 0.08, 0.13, 0.3])
BLINK_VALUES = np.array([0.0, 1.0, 1.0, 0.0])
BLINK = float(BLINK_TIMES[-1])

# Small head motion, ours: a new pose every 1.9 s, up to so many degrees each way. AUs: (negative, positive).
SWAY_PERIOD = 1.9  # s
SWAY = {(52, 51): 1.6, (53, 54): 1.1, (55, 56): 1.0}
# Small saccades, ours: a new point of fixation every 1.1 s, up to so many degrees. One of a degree takes
# 0.02 s, less than a frame: it is there at once.
SACCADE_PERIOD = 1.1  # s
SACCADE = {(62, 61): 1.4, (63, 64): 0.9}
# Eyes stay where they look while the head sways: they turn back by as much as it turns (degrees).
COUNTER = {(52, 51): (61, 62), (53, 54): (64, 63)}
# Poses are worked out from one multiple of so many to another, and the latest are kept, 5 kB each: sessions
# of one seed share them, and windows that begin close to each other.
BATCH, KEPT = 8, 512


@dataclass(frozen=True, eq=False)
class Fewer(Channel):
    """What is taken from the blinks; it counts for those that began before it had gone, until they end."""

    @cached_property
    def span(self) -> tuple[float, float]:
        first, last = super().span
        return first, last + BLINK


class PhraseEnd(NamedTuple):
    """Where something said from `since` on pauses: blinks belong there. Seconds on the session clock."""

    since: float
    at: float


@dataclass(frozen=True, eq=False)
class Blinks:
    """Those of a span of time.

    Attributes:
        onsets: (b,) float64 seconds.
        draws: (b,) 0..1, drawn from the number of each, so that fewer blinks are some of the usual ones.
    """

    onsets: Float64
    draws: Float64

    def kept(self, part: Float64) -> Blinks:
        """Those of which this part (b,) is above their draw: each comes whole or not at all."""
        comes = part > self.draws
        return Blinks(self.onsets[comes], self.draws[comes])

    def at(self, times: Float64) -> Float64:
        """(n,) 0..1: how far the lids are shut at times (n,), not falling."""
        shut = np.zeros(len(times))
        firsts, lasts = times.searchsorted(self.onsets), times.searchsorted(self.onsets + BLINK)
        for onset, first, last in zip(self.onsets.tolist(), firsts.tolist(), lasts.tolist(), strict=True):
            seen = shut[first:last]
            np.maximum(seen, np.interp(times[first:last] - onset, BLINK_TIMES, BLINK_VALUES), out=seen)
        return smooth(shut)


@dataclass(frozen=True, eq=False)
class Motion:
    """Head sway (AU51-56) and what the eyes do (AU61-64) in a span of time.

    Attributes:
        columns: (m,) what moves, each column once.
        keys: (s, k) seconds: when each way of the head to turn reaches each of its poses.
        poses: (m, k) 0..1: the columns in these poses.
        way: (m,) the way of the head to turn that moves each column.
        jumps: (j,) seconds: when the eyes jump to a new point.
        points: (e, j) 0..1: what is added from then on to the last e columns.
    """

    columns: tuple[int, ...]
    keys: Float64
    poses: Float64
    way: Index
    jumps: Float64
    points: Float64

    def at(self, times: Float64) -> Float64:
        """(m, n) 0..1 at times (n,), not falling, within the span."""
        keys, ends = self._ends
        frames = _frames(keys, ends, times)
        sways, at_points = frames[: self.keys.size], frames[self.keys.size :]
        shape = (len(self.keys), len(times))
        passed = np.empty(shape)
        passed[:] = times
        passed -= self.keys.repeat(sways).reshape(shape)
        passed /= self._lengths.repeat(sways).reshape(shape)
        moved = smooth(passed).take(self.way, axis=0)
        sways = sways.reshape(self.keys.shape).take(self.way, axis=0).ravel()
        moved *= self._steps.repeat(sways).reshape(moved.shape)
        moved += self.poses.repeat(sways).reshape(moved.shape)
        moved[-len(self.points) :] += self.points.repeat(at_points, axis=1)
        return moved

    @cached_property
    def _ends(self) -> tuple[Float64, Index]:
        """All keys, those of the jumps last, and which of them are the last of their kind."""
        keys = np.concatenate([self.keys.ravel(), self.jumps])
        return keys, np.append(np.arange(1, len(self.keys) + 1) * self.keys.shape[1], len(keys)) - 1

    @cached_property
    def _lengths(self) -> Float64:
        """(s, k) seconds from each pose to the next one."""
        return np.diff(self.keys, append=self.keys[:, -1:] + 1.0)

    @cached_property
    def _steps(self) -> Float64:
        """(m, k) what is added from each pose to the next one."""
        return np.diff(self.poses, append=self.poses[:, -1:])


def _frames(keys: Float64, ends: Index, times: Float64) -> Index:
    """(k,): at how many of the times (n,) each key (k,) is the newest; a first one before it too."""
    first = times.searchsorted(keys)
    first[ends[:-1] + 1] = first[0] = 0
    frames = np.empty_like(first)
    np.subtract(first[1:], first[:-1], out=frames[:-1])
    frames[ends] = len(times) - first[ends]
    return frames


@dataclass(frozen=True, eq=False)
class Idle:
    """All that a face does by itself in a span of time."""

    blinks: Blinks
    motion: Motion


def idle_face(start: float, end: float, seed: int, ends: Sequence[PhraseEnd] = ()) -> Idle:
    """Blinks, head sway and saccades.

    Args:
        start, end: seconds on the session clock: right from start to end, both included.
        seed: of the character.
        ends: where its phrases end, in order of time; a blink that is due near one comes there instead.
    """
    sways, jumps = _numbers(start, end, SWAY_PERIOD), _numbers(start, end, SACCADE_PERIOD)
    return Idle(_blinks(start, end, seed, ends), _motion(seed, sways, jumps))


def _numbers(start: float, end: float, period: float) -> tuple[int, int]:
    """(first, last + 1) of the poses, about `period` apart, that can be seen in start..end, and some more."""
    first, last = math.floor(start / period) - 2, math.ceil(end / period) + 2
    return first // BATCH * BATCH, (last // BATCH + 1) * BATCH


@lru_cache(maxsize=KEPT)
def _motion(seed: int, sways: tuple[int, int], jumps: tuple[int, int]) -> Motion:
    """With poses sways[0] .. sways[1] - 1 of the head, and points jumps[0] .. jumps[1] - 1 of the eyes."""
    turns = [(kind, kind, most) for kind, most in enumerate(SWAY.values(), 1)]
    keys, degrees = _poses(seed, turns, sways, SWAY_PERIOD)
    poses = {
        column: (way, values)
        for way, sides in enumerate(SWAY)
        for moved in (sides, COUNTER.get(sides, ()))
        for column, values in _turn(moved, degrees[way])
    }
    # Both directions jump at the same instants: a saccade is one movement.
    looks = [(10, 11 + kind, most) for kind, most in enumerate(SACCADE.values())]
    times, aims = _poses(seed, looks, jumps, SACCADE_PERIOD)
    points = dict(pair for sides, row in zip(SACCADE, aims, strict=True) for pair in _turn(sides, row))
    columns = (*(column for column in poses if column not in points), *points)
    return Motion(
        columns,
        keys,
        np.array([poses[column][1] for column in columns]),
        np.array([poses[column][0] for column in columns]),
        times[0],
        np.array(list(points.values())),
    )


def _turn(sides: Sequence[int], degrees: Float64) -> Iterator[tuple[int, Float64]]:
    """Signed degrees as two AUs, column and values; between keys they add up to the same smooth course."""
    for number, sign in zip(sides, (-1.0, 1.0), strict=False):
        most = tables.by_number(tables.action_units())[number].degrees
        yield au(number)[0].column, np.maximum(sign * degrees, 0.0) / most


def _poses(
    seed: int, movements: Sequence[tuple[int, int, float]], numbers: tuple[int, int], period: float
) -> tuple[Float64, Float64]:
    """Seconds and degrees, (m, k) each, of the poses numbers[0] .. numbers[1] - 1, about `period` apart.

    Args:
        movements: of each, the kind that draws its times, the kind that draws its degrees, the most of these.
    """
    k = np.arange(*numbers)
    kinds = [kind for times, way, _ in movements for kind in (times, 100 + way, 200 + way)]
    late, one, other = uniform(seed, kinds, k).reshape(len(movements), 3, len(k)).transpose(1, 0, 2)
    # The mean of two draws: small poses are more common than large ones.
    degrees = np.array([most for _, _, most in movements])[:, None] * (one + other - 1.0)
    return (k + 0.7 * late) * period, degrees


def _blinks(start: float, end: float, seed: int, ends: Sequence[PhraseEnd]) -> Blinks:
    """Those that can be seen in start..end; the first comes after 0."""
    moved = prosody_facts()["blinks"]["reach"] + prosody_facts()["blinks"]["delay"] if ends else 0.0
    count = 64
    while (drawn := _drawn(seed, count))[0, -1] <= end + moved:
        count *= 2
    first, last = drawn[0].searchsorted((start - BLINK - moved, end + moved), "right")
    onsets, draws, late = drawn[:, first:last]
    if ends:
        onsets = np.array(
            [_placed(at, part, ends) for at, part in zip(onsets.tolist(), late.tolist(), strict=True)]
        )
        seen = (onsets + BLINK >= start) & (onsets <= end)
        onsets, draws = onsets[seen], draws[seen]
    return Blinks(onsets, draws)


def _placed(at: float, late: float, ends: Sequence[PhraseEnd]) -> float:
    """When a blink comes that is due: at the nearest end of a phrase, if it is due since the speech began.

    No blink depends on another one, so that what is forgotten changes nothing that is still to be seen.
    """
    facts = prosody_facts()["blinks"]
    first = bisect_left(ends, at - facts["reach"], key=lambda end: end.at)
    last = bisect_left(ends, at + facts["reach"], lo=first, key=lambda end: end.at)
    near = [end for end in ends[first:last] if end.since <= at]
    if not near:
        return at
    # What is said later may not take a blink from where it was shown already.
    best = min(near, key=lambda end: (end.since, abs(end.at - at)))
    return best.at + late * float(facts["delay"])


@lru_cache(maxsize=64)
def _drawn(seed: int, count: int) -> Float64:
    """(3, count) of the first blinks of a face: when they are due, in seconds, rising; two draws of each."""
    normal, turn, draw, late = uniform(seed, (301, 302, 304, 305), np.arange(count))
    # Box-Muller: two uniform numbers make a normal one.
    normal = np.sqrt(-2.0 * np.log1p(-normal)) * np.cos(2.0 * np.pi * turn)
    gaps = np.clip(BLINK_MEDIAN * np.exp(BLINK_SPREAD * normal), BLINK_LEAST, BLINK_MOST)
    gaps[0] *= uniform(seed, 303, np.arange(1))[0]  # nobody begins a session with a blink at the same time
    return np.stack([np.cumsum(gaps), draw, late])
