"""A seed and a span of time -> what a face does when it does nothing: blinks, small head motion, saccades.

Everything is a function of (seed, time) alone: each movement has a number k = 0, 1, 2, .. and draws what is
random about it from (seed, kind, k), so any two windows of time agree where they overlap.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.chance import uniform
from realizer.animation.channel import Channel, Layer
from realizer.animation.targets import au
from realizer.arrays import Float64
from realizer.speech.accents import prosody_facts

__all__ = ["Blink", "Fewer", "PhraseEnd", "idle_channels"]

# s between two blinks: log-normal, as measured inter-blink times are; its median and limits are ours.
BLINK_MEDIAN, BLINK_SPREAD, BLINK_LEAST, BLINK_MOST = 3.8, 0.3, 2.5, 6.0
# s: a lid closes faster than it opens; 0.05 s shut is at least one frame at 25 fps. 0.3 s in all.
BLINK_TIMES = (0.0, 0.08, 0.13, 0.3)
BLINK_VALUES = (0.0, 1.0, 1.0, 0.0)

# Small head motion, ours: a new pose every 1.9 s, up to so many degrees each way. AUs: (negative, positive).
SWAY_PERIOD = 1.9  # s
SWAY = {(52, 51): 1.6, (53, 54): 1.1, (55, 56): 1.0}
# Small saccades, ours: a new point of fixation every 1.1 s, up to so many degrees, reached in 0.04 s.
SACCADE_PERIOD = 1.1  # s
SACCADE = {(62, 61): 1.4, (63, 64): 0.9}
SACCADE_TIME = 0.04  # s
# Eyes stay where they look while the head sways: they turn back by as much as it turns (degrees).
COUNTER = {(52, 51): (61, 62), (53, 54): (64, 63)}


@dataclass(frozen=True, eq=False)
class Blink(Channel):
    """One lid of an idle blink; it comes where the part of the blinks that the face keeps is above `draw`.

    Attributes:
        draw: 0..1, drawn from the number of the blink, so that fewer blinks are some of the usual ones.
    """

    draw: float = 0.0


@dataclass(frozen=True, eq=False)
class Fewer(Channel):
    """What is taken from the blinks; it counts for those that began before it had gone, until they end."""

    @cached_property
    def span(self) -> tuple[float, float]:
        first, last = super().span
        return first, last + BLINK_TIMES[-1]


class PhraseEnd(NamedTuple):
    """Where something said from `since` on pauses: blinks belong there. Seconds on the session clock."""

    since: float
    at: float


def idle_channels(start: float, end: float, seed: int, ends: Sequence[PhraseEnd] = ()) -> list[Channel]:
    """Blinks (AU45), head sway (AU51-56) and saccades (AU61-64) of the idle layer.

    Args:
        start, end: seconds on the session clock; the channels are right from start to end, both included.
        seed: of the character.
        ends: where its phrases end, in order of time; a blink that is due near one comes there instead.

    Returns:
        Channels on the session clock. Blend a window of time with its own channels only.
    """
    channels: list[Channel] = [
        Blink(
            lid,
            at + np.array(BLINK_TIMES),
            np.array(BLINK_VALUES),
            layer=Layer.IDLE,
            source="idle",
            draw=draw,
        )
        for at, draw in _blinks(start, end, seed, ends)
        for lid in au(45)
    ]
    sways = _poses(
        start, end, seed, [(kind, kind, most) for kind, most in enumerate(SWAY.values(), 1)], SWAY_PERIOD
    )
    for sides, (times, degrees) in zip(SWAY, sways, strict=True):
        channels += _turn(sides, times, degrees)
        if sides in COUNTER:
            channels += _turn(COUNTER[sides], times, degrees)
    # Both directions jump at the same instants: a saccade is one movement.
    jumps = [(10, 11 + kind, most) for kind, most in enumerate(SACCADE.values())]
    for sides, (times, degrees) in zip(SACCADE, _poses(start, end, seed, jumps, SACCADE_PERIOD), strict=True):
        held = np.repeat(times, 2)[1:]
        held[1::2] = times[1:] + SACCADE_TIME
        channels += _turn(sides, held, np.repeat(degrees, 2)[:-1])
    return channels


def _turn(sides: tuple[int, int], times: Float64, degrees: Float64) -> list[Channel]:
    """Signed degrees as two AUs; between keys they add up to the same smooth course."""
    return [
        Channel(
            au(number)[0],
            times,
            np.maximum(sign * degrees, 0.0) / _degrees(number),
            layer=Layer.IDLE,
            source="idle",
        )
        for number, sign in zip(sides, (-1.0, 1.0), strict=True)
    ]


@lru_cache(maxsize=32)
def _degrees(number: int) -> float:
    return tables.by_number(tables.action_units())[number].degrees


def _poses(
    start: float, end: float, seed: int, movements: Sequence[tuple[int, int, float]], period: float
) -> list[tuple[Float64, Float64]]:
    """Times (k,) and degrees (k,) of the poses of movements around start..end, about `period` apart.

    Args:
        movements: of each, the kind that draws its times, the kind that draws its degrees, the most of these.
    """
    first, last = math.floor(start / period) - 2, math.ceil(end / period) + 2
    k = np.arange(first, last + 1)
    kinds = [kind for times, way, _ in movements for kind in (times, 100 + way, 200 + way)]
    late, one, other = uniform(seed, kinds, k).reshape(len(movements), 3, len(k)).transpose(1, 0, 2)
    times = (k + 0.7 * late) * period
    # The mean of two draws: small poses are more common than large ones.
    degrees = np.array([most for _, _, most in movements])[:, None] * (one + other - 1.0)
    return list(zip(times, degrees, strict=True))


def _blinks(start: float, end: float, seed: int, ends: Sequence[PhraseEnd]) -> list[tuple[float, float]]:
    """Onset and draw of the blinks that can be seen in start..end; the first comes after 0."""
    moved = prosody_facts()["blinks"]["reach"] + prosody_facts()["blinks"]["delay"] if ends else 0.0
    count = 64
    while (onsets := _onsets(seed, count))[-1] <= end + moved:
        count *= 2
    seen = np.flatnonzero((onsets + BLINK_TIMES[-1] + moved >= start) & (onsets - moved <= end))
    draws, late = uniform(seed, (304, 305), seen).tolist()
    placed = [_placed(at, part, ends) for at, part in zip(onsets[seen].tolist(), late, strict=True)]
    near = zip(placed, draws, strict=True)
    return [(at, draw) for at, draw in near if at + BLINK_TIMES[-1] >= start and at <= end]


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


@lru_cache(maxsize=256)
def _onsets(seed: int, count: int) -> Float64:
    """The first `count` blinks of a face: (count,) seconds, rising."""
    k = np.arange(count)
    # Box-Muller: two uniform numbers make a normal one.
    normal = np.sqrt(-2.0 * np.log1p(-uniform(seed, 301, k))) * np.cos(2.0 * np.pi * uniform(seed, 302, k))
    gaps = np.clip(BLINK_MEDIAN * np.exp(BLINK_SPREAD * normal), BLINK_LEAST, BLINK_MOST)
    gaps[0] *= uniform(seed, 303, k[:1])[0]  # nobody begins a session with a blink at the same time
    return np.cumsum(gaps)
