"""Idle motion of a face: blinks, small head motion, saccades.

Everything is a function of (seed, time) alone: each movement has a number k = 0, 1, 2, .. and draws what is
random about it from (seed, kind, k), so any two windows of time agree where they overlap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.curves import smooth
from realizer.animation.idle.blinks import Blinks, PhraseEnd, blinks_between
from realizer.animation.idle.rng import uniform
from realizer.core.array_types import Float64, Index

# Small head motion, ours: a new pose every 1.9 s, up to so many degrees each way. AUs: (negative, positive).
SWAY_PERIOD = 1.9  # s
SWAY = {(52, 51): 1.6, (53, 54): 1.1, (55, 56): 1.0}
# Small saccades, ours: a new point of fixation every 1.1 s, up to so many degrees.
SACCADE_PERIOD = 1.1  # s
SACCADE = {(62, 61): 1.4, (63, 64): 0.9}
SACCADE_LEAST, SACCADE_DEGREE = 0.021, 0.0022  # s, and s for each degree (Carpenter 1988, the main sequence)
# Eyes stay where they look while the head sways: they turn back by as much as it turns (degrees).
COUNTER = {(52, 51): (61, 62), (53, 54): (64, 63)}
# Poses are worked out from one multiple of so many to another, and the latest are kept, 5 kB each: sessions
# of one seed share them, and windows that begin close to each other.
BATCH, KEPT = 8, 512


@dataclass(frozen=True, eq=False)
class Motion:
    """Head sway (AU51-56) and what the eyes do (AU61-64) in a span of time.

    Attributes:
        columns: (m,) what moves, each column once.
        keys: (s, k) seconds: when each way of the head to turn reaches each of its poses.
        poses: (m, k) 0..1: the columns in these poses.
        way: (m,) the way of the head to turn that moves each column.
        jumps: (j,) seconds: when the eyes leave for a new point.
        durations: (j,) seconds: how long they are on their way.
        points: (e, j) 0..1: what is added to the last e columns when they are there.
    """

    columns: tuple[int, ...]
    keys: Float64
    poses: Float64
    way: Index
    jumps: Float64
    durations: Float64
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
        # A minimum-jerk course is the same both ways: what is left to go is 1 at first and falls to 0.
        to_go = self._arrivals.repeat(at_points)
        to_go -= times
        to_go /= self.durations.repeat(at_points)
        np.maximum(to_go, 0.0, out=to_go)
        eyes = moved[-len(self.points) :]
        eyes += self.points.repeat(at_points, axis=1)
        eyes -= smooth(to_go) * self._leaps.repeat(at_points, axis=1)
        return moved

    @cached_property
    def _ends(self) -> tuple[Float64, Index]:
        """All keys, those of the jumps last, and which of them are the last of their kind."""
        keys = np.concatenate([self.keys.ravel(), self.jumps])
        return keys, np.append(np.arange(1, len(self.keys) + 1) * self.keys.shape[1], len(keys)) - 1

    @cached_property
    def _arrivals(self) -> Float64:
        """(j,) seconds: when the eyes are at each point."""
        arrivals: Float64 = self.jumps + self.durations
        return arrivals

    @cached_property
    def _leaps(self) -> Float64:
        """(e, j) how far each point is from the one before."""
        return np.diff(self.points, prepend=self.points[:, :1])

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
    return Idle(blinks_between(start, end, seed, ends), _motion(seed, sways, jumps))


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
    # Both directions leave at the same instants: a saccade is one movement.
    looks = [(10, 11 + kind, most) for kind, most in enumerate(SACCADE.values())]
    times, aims = _poses(seed, looks, jumps, SACCADE_PERIOD)
    leaps = np.hypot(*np.diff(aims, prepend=aims[:, :1]))
    points = dict(pair for sides, row in zip(SACCADE, aims, strict=True) for pair in _turn(sides, row))
    columns = (*(column for column in poses if column not in points), *points)
    return Motion(
        columns,
        keys,
        np.array([poses[column][1] for column in columns]),
        np.array([poses[column][0] for column in columns]),
        times[0],
        SACCADE_LEAST + SACCADE_DEGREE * leaps,
        np.array(list(points.values())),
    )


def _turn(sides: Sequence[int], degrees: Float64) -> Iterator[tuple[int, Float64]]:
    """Signed degrees as two AUs, column and values; between keys they add up to the same smooth course."""
    for number, sign in zip(sides, (-1.0, 1.0), strict=False):
        most = tables.by_number()[number].degrees
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
