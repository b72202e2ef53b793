"""Blinks of a face, aligned with the ends of its phrases.

Blinks are numbered k = 0, 1, 2, ..., and their random numbers depend on (seed, kind, k) alone, so that any
two windows of time agree where they overlap.
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

# s between two blinks: log-normal, as measured inter-blink times are; median and limits are our choice.
BLINK_MEDIAN, BLINK_SPREAD, BLINK_LEAST, BLINK_MOST = 3.8, 0.3, 2.5, 6.0
# s: lids close faster than they open; they are shut for 0.05 s, at least one frame at 25 fps.
BLINK_TIMES = np.array([0.0, 0.08, 0.13, 0.3])
BLINK_VALUES = np.array([0.0, 1.0, 1.0, 0.0])
BLINK = float(BLINK_TIMES[-1])


@dataclass(frozen=True, eq=False)
class BlinkReduction(Channel):
    """A channel of the mask "blinks"; its span includes the end of the last blink that it suppresses."""

    @cached_property
    def span(self) -> tuple[float, float]:
        first, last = super().span
        return first, last + BLINK


class PhraseEnd(NamedTuple):
    """The end `at` of a phrase in a speech that starts at `since`; seconds on the session clock."""

    since: float
    at: float


@dataclass(frozen=True, eq=False)
class Blinks:
    """The blinks in a span of time.

    Attributes:
        onsets: (b,) float64 seconds.
        draws: (b,) 0..1, random; a blink is shown if the wanted part of blinks exceeds its draw.
    """

    onsets: Float64
    draws: Float64

    def reduced(self, part: Float64) -> Blinks:
        """Return a random part (b,), 0..1, of the blinks; each is kept whole or not at all."""
        kept = part > self.draws
        return Blinks(self.onsets[kept], self.draws[kept])

    def at(self, times: Float64) -> Float64:
        """Return how far the lids are shut, (n,) 0..1, at times (n,), not falling."""
        shut = np.zeros(len(times))
        firsts, lasts = times.searchsorted(self.onsets), times.searchsorted(self.onsets + BLINK)
        for onset, first, last in zip(self.onsets.tolist(), firsts.tolist(), lasts.tolist(), strict=True):
            seen = shut[first:last]
            np.maximum(seen, np.interp(times[first:last] - onset, BLINK_TIMES, BLINK_VALUES), out=seen)
        return smooth(shut)


def blinks_between(start: float, end: float, seed: int, ends: Sequence[PhraseEnd] = ()) -> Blinks:
    """Return the blinks visible in start..end, seconds on the session clock; the first is after 0.

    Args:
        seed: of the character.
        ends: the ends of its phrases, in order of time; a blink near one is moved there.
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
    """Return the time of a blink due `at`: the nearest end of a phrase of a speech that has begun by then.

    No blink depends on another one, so that past blinks can be forgotten.
    """
    facts = prosody_facts()["blinks"]
    first = bisect_left(ends, at - facts["reach"], key=lambda end: end.at)
    last = bisect_left(ends, at + facts["reach"], lo=first, key=lambda end: end.at)
    near = [end for end in ends[first:last] if end.since <= at]
    if not near:
        return at
    # A later speech must not move a blink that may have been shown.
    best = min(near, key=lambda end: (end.since, abs(end.at - at)))
    return best.at + late * float(facts["delay"])


@lru_cache(maxsize=64)
def _draws(seed: int, count: int) -> Float64:
    """Return (3, count) for the first blinks: rising seconds at which they are due, two random numbers."""
    normal, turn, draw, late = uniform(seed, (301, 302, 304, 305), np.arange(count))
    # Box-Muller: two uniform numbers make a normal one.
    normal = np.sqrt(-2.0 * np.log1p(-normal)) * np.cos(2.0 * np.pi * turn)
    gaps = np.clip(BLINK_MEDIAN * np.exp(BLINK_SPREAD * normal), BLINK_LEAST, BLINK_MOST)
    gaps[0] *= uniform(seed, 303, np.arange(1))[0]  # so that not all characters blink first at the same time
    return np.stack([np.cumsum(gaps), draw, late])
