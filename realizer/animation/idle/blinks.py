"""Blinks of a face, aligned with the ends of its phrases.

Each has a number k = 0, 1, 2, .. and draws what is random about it from (seed, kind, k), so any two windows
of time agree where they overlap.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from realizer.animation.channel import Channel
from realizer.animation.curves import smooth
from realizer.animation.idle.rng import uniform
from realizer.core.array_types import Float64
from realizer.speech.accents import prosody_facts

# s between two blinks: log-normal, as measured inter-blink times are; its median and limits are ours.
BLINK_MEDIAN, BLINK_SPREAD, BLINK_LEAST, BLINK_MOST = 3.8, 0.3, 2.5, 6.0
# s: a lid closes faster than it opens; 0.05 s shut is at least one frame at 25 fps. 0.3 s in all.
BLINK_TIMES = np.array([0.0, 0.08, 0.13, 0.3])
BLINK_VALUES = np.array([0.0, 1.0, 1.0, 0.0])
BLINK = float(BLINK_TIMES[-1])


@dataclass(frozen=True, eq=False)
class BlinkReduction(Channel):
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

    def reduced(self, part: Float64) -> Blinks:
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


def blinks_between(start: float, end: float, seed: int, ends: Sequence[PhraseEnd] = ()) -> Blinks:
    """Those that can be seen in start..end, seconds on the session clock; the first comes after 0.

    Args:
        seed: of the character.
        ends: where its phrases end, in order of time; a blink that is due near one comes there instead.
    """
    moved = prosody_facts()["blinks"]["reach"] + prosody_facts()["blinks"]["delay"] if ends else 0.0
    count = 64
    while (drawn := _draws(seed, count))[0, -1] <= end + moved:
        count *= 2
    first, last = drawn[0].searchsorted((start - BLINK - moved, end + moved), "right")
    onsets, draws, late = drawn[:, first:last]
    if ends:
        onsets = np.array(
            [_blink_time(at, part, ends) for at, part in zip(onsets.tolist(), late.tolist(), strict=True)]
        )
        seen = (onsets + BLINK >= start) & (onsets <= end)
        onsets, draws = onsets[seen], draws[seen]
    return Blinks(onsets, draws)


def _blink_time(at: float, late: float, ends: Sequence[PhraseEnd]) -> float:
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
def _draws(seed: int, count: int) -> Float64:
    """(3, count) of the first blinks of a face: when they are due, in seconds, rising; two draws of each."""
    normal, turn, draw, late = uniform(seed, (301, 302, 304, 305), np.arange(count))
    # Box-Muller: two uniform numbers make a normal one.
    normal = np.sqrt(-2.0 * np.log1p(-normal)) * np.cos(2.0 * np.pi * turn)
    gaps = np.clip(BLINK_MEDIAN * np.exp(BLINK_SPREAD * normal), BLINK_LEAST, BLINK_MOST)
    gaps[0] *= uniform(seed, 303, np.arange(1))[0]  # nobody begins a session with a blink at the same time
    return np.stack([np.cumsum(gaps), draw, late])
