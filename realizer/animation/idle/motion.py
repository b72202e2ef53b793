"""Idle motion of head and eyes: sway and saccades.

It is a function of (seed, time) alone. Movements are numbered k = 0, 1, 2, ..., and their random numbers
depend on (seed, kind, k), so that any two windows of time agree where they overlap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.curves import smooth
from realizer.animation.idle.blinks import idle_facts
from realizer.animation.idle.rng import uniform
from realizer.core.array_types import Bool, Float64, Index

# Small head motion (our values): a new pose every 1.9 s, within the given degrees. AUs: (negative, positive).
SWAY_PERIOD = 1.9  # s
SWAY = {(52, 51): 1.6, (53, 54): 1.1, (55, 56): 1.0}
# Small saccades (our values): a new point of fixation every 1.1 s, within the given degrees.
SACCADE_PERIOD = 1.1  # s
SACCADE = {(62, 61): 1.4, (63, 64): 0.9}
SACCADE_LEAST, SACCADE_DEGREE = 0.021, 0.0022  # s, and s for each degree (Carpenter 1988, the main sequence)
# Eyes keep their direction while the head sways: they turn back by as many degrees.
COUNTER = {(52, 51): (61, 62), (53, 54): (64, 63)}
# Poses are computed in batches; the latest batches are cached, 5 kB each, for neighbouring windows and
# sessions with the same seed.
BATCH, CACHED = 8, 512


@dataclass(frozen=True, eq=False)
class Motion:
    """Head sway (AU51-56) and eye movements (AU61-64) in a span of time."""

    columns: tuple[int, ...]  # (m,) the columns that move
    # keys, lengths: (s, k) seconds at which each direction of head rotation reaches its poses, and from each
    # to the next one
    keys: Float64
    lengths: Float64
    # poses, steps: (m, k) 0..1: the columns in these poses, and their differences to the next one
    poses: Float64
    steps: Float64
    way: Index  # (m,) the direction of head rotation that moves each column
    jumps: Float64  # (j,) seconds at which saccades start
    durations: Float64  # (j,) seconds of saccades
    # points, leaps: (e, j) 0..1: the points of fixation, added to the last e columns, and their differences
    # to the one before
    points: Float64
    leaps: Float64
    aims: Float64  # (2, j) degrees: the points of fixation, directions as in `SACCADE`
    # seed, number: of the character, and of the first saccade
    seed: int
    number: int

    def looking(self, patterns: Mapping[str, Bool]) -> Motion:
        """Return the motion with the points of fixation of "listening" or "thinking" at some saccades."""
        aims = self.aims
        for name, active in patterns.items():
            aims = np.where(active, _pattern(self.seed, name, self.number, len(active)), aims)
        durations, points, leaps = _looks(aims)
        return replace(self, durations=durations, points=points, leaps=leaps, aims=aims)

    def at(self, times: Float64) -> Float64:
        """Return the columns, (m, n) 0..1, at times (n,), not falling, within the span."""
        last = np.array([_latest(keys, times) for keys in self.keys])
        way = np.arange(len(self.keys))[:, None]
        part = smooth((times - self.keys[way, last]) / self.lengths[way, last])[self.way]
        column, last = np.arange(len(self.columns))[:, None], last[self.way]
        moved: Float64 = part * self.steps[column, last] + self.poses[column, last]
        last = _latest(self.jumps, times)
        # The minimum-jerk curve is symmetric, so the remaining part of a saccade, from 1 to 0, suffices.
        to_go = np.maximum((self.jumps[last] + self.durations[last] - times) / self.durations[last], 0.0)
        eyes = moved[-len(self.points) :]
        eyes += self.points[:, last]
        eyes -= smooth(to_go) * self.leaps[:, last]
        return moved


def _latest(keys: Float64, times: Float64) -> Index:
    """Return (n,) the latest key at each time; the first one also counts before it."""
    return np.maximum(keys.searchsorted(times, "right") - 1, 0)


def motion_between(start: float, end: float, seed: int) -> Motion:
    """Return the motion of head and eyes from start to end, seconds on the session clock, both included."""
    return _motion(seed, _numbers(start, end, SWAY_PERIOD), _numbers(start, end, SACCADE_PERIOD))


def _numbers(start: float, end: float, period: float) -> tuple[int, int]:
    """Return (first, last + 1) of the batches of poses, about `period` apart, that include start..end."""
    first, last = math.floor(start / period) - 2, math.ceil(end / period) + 2
    return first // BATCH * BATCH, (last // BATCH + 1) * BATCH


@lru_cache(maxsize=CACHED)
def _motion(seed: int, sways: tuple[int, int], jumps: tuple[int, int]) -> Motion:
    """Return motion with head poses sways[0] .. sways[1] - 1 and eye points jumps[0] .. jumps[1] - 1."""
    turns = [(kind, kind, most) for kind, most in enumerate(SWAY.values(), 1)]
    keys, degrees = _poses(seed, turns, sways, SWAY_PERIOD)
    poses = {
        column: (way, values)
        for way, sides in enumerate(SWAY)
        for moved in (sides, COUNTER.get(sides, ()))
        for column, values in turned(moved, degrees[way])
    }
    # A saccade moves both directions at the same instant.
    looks = [(10, 11 + kind, most) for kind, most in enumerate(SACCADE.values())]
    times, aims = _poses(seed, looks, jumps, SACCADE_PERIOD)
    saccades = _looks(aims)
    columns = motion_columns()
    values = np.array([poses[column][1] for column in columns])
    return Motion(
        columns,
        keys,
        np.diff(keys, append=keys[:, -1:] + 1.0),
        values,
        np.diff(values, append=values[:, -1:]),
        np.array([poses[column][0] for column in columns]),
        times[0],
        *saccades,
        aims,
        seed,
        jumps[0],
    )


@cache
def motion_columns() -> tuple[int, ...]:
    return tuple(au(number)[0].column for sides in (*SWAY, *SACCADE) for number in sides)


def _looks(aims: Float64) -> tuple[Float64, Float64, Float64]:
    """Return durations, points and leaps of saccades to `aims`, (2, j) degrees."""
    points = np.array(
        [row for sides, way in zip(SACCADE, aims, strict=True) for _, row in turned(sides, way)]
    )
    durations = SACCADE_LEAST + SACCADE_DEGREE * np.hypot(*np.diff(aims, prepend=aims[:, :1]))
    return durations, points, np.diff(points, prepend=points[:, :1])


def _pattern(seed: int, name: str, first: int, count: int) -> Float64:
    """Return the points, (2, count) degrees as in `SACCADE`, at which a listening or thinking face looks."""
    facts, k = idle_facts()[name], np.arange(first, first + count)
    place, *spread = uniform(seed, (20,), k // facts["stay"])[0], *uniform(seed, (21, 22), k)
    shares = np.cumsum([one["share"] for one in facts["places"]])
    chosen = np.minimum(shares.searchsorted(place * shares[-1], "right"), len(shares) - 1)
    yaw, pitch, most = (
        np.array([one[key] for one in facts["places"]])[chosen] for key in ("yaw", "pitch", "spread")
    )
    sides, up = (most * (2.0 * draw - 1.0) for draw in spread)
    return np.stack([yaw + sides, -(pitch + up)])


def turned(sides: Sequence[int], degrees: Float64) -> Iterator[tuple[int, Float64]]:
    """Yield column and values of the two AUs that represent signed degrees."""
    for number, sign in zip(sides, (-1.0, 1.0), strict=False):
        most = tables.by_number()[number].degrees
        yield au(number)[0].column, np.maximum(sign * degrees, 0.0) / most


def _poses(
    seed: int, movements: Sequence[tuple[int, int, float]], numbers: tuple[int, int], period: float
) -> tuple[Float64, Float64]:
    """Return seconds and degrees, (m, k) each, of poses numbers[0] .. numbers[1] - 1, about `period` apart.

    A movement has the random kind of its times, that of its degrees, and the greatest degrees.
    """
    k = np.arange(*numbers)
    kinds = [kind for times, way, _ in movements for kind in (times, 100 + way, 200 + way)]
    late, one, other = uniform(seed, kinds, k).reshape(len(movements), 3, len(k)).transpose(1, 0, 2)
    # The mean of two draws: small poses are more common than large ones.
    degrees = np.array([most for _, _, most in movements])[:, None] * (one + other - 1.0)
    return (k + 0.7 * late) * period, degrees
