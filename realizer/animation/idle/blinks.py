"""Blinks of a face, aligned with the ends of its phrases, with saccades and with large gaze shifts.

Blinks are numbered k = 0, 1, 2, ..., and their random numbers depend on (seed, kind, k) alone, so that any
two windows of time agree where they overlap. Further blinks, at the ends of phrases and at gaze shifts, have
random numbers that depend on their time.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import smooth
from realizer.animation.idle.rng import uniform
from realizer.core import work
from realizer.core.array_types import Bool, Float64, Index
from realizer.speech.accents import prosody_facts

idle_facts = partial(tables.toml_table, "idle.toml")
LIDS = np.array([0.0, 1.0, 1.0, 0.0])  # at the key times of a blink
NUMBERED, FURTHER = 310, 320  # the first kinds of random numbers for the shapes of blinks


@dataclass(frozen=True, eq=False)
class OnsetMask(Channel):
    """A mask that is read at the onset of a blink or saccade.

    Its span includes the end of the last movement whose onset it masks.
    """

    @cached_property
    def span(self) -> tuple[float, float]:
        first, last = super().span
        return first, last + 4.0  # s: two fixations


class PhraseEnd(NamedTuple):
    """The end `at` of a phrase in a speech that starts at `since`; seconds on the session clock."""

    since: float
    at: float


class GazeShift(NamedTuple):
    """A gaze shift that begins `at` seconds on the session clock, by `degrees` of eyes and head together."""

    at: float
    degrees: float


class Occasions(NamedTuple):
    """What moves blinks or adds some: ends of phrases, saccades (k,) and gaze shifts, in order of time."""

    ends: Sequence[PhraseEnd]
    saccades: Float64
    shifts: Sequence[GazeShift]


NOTHING = Occasions((), np.zeros(0), ())


@dataclass(frozen=True, eq=False)
class Blinks:
    """The blinks in a span of time."""

    onsets: Float64  # (b,) float64 seconds
    draws: Float64  # (b,) 0..1, random; a blink is shown if the wanted part of blinks exceeds its draw
    keys: Float64  # (4, b) seconds from the onset: lids begin to move, are closed, begin to open, are open
    amounts: Float64  # (b,) 0..1 how far the lids close
    # (b,) seconds by which the right lid is later than the left one; if negative, the left one is
    lags: Float64

    def only(self, kept: Bool) -> Blinks:
        return Blinks(*(values[..., kept] for values in vars(self).values()))

    def together(self, other: Blinks) -> Blinks:
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return Blinks(*(np.concatenate(pair, axis=-1) for pair in pairs))

    def reduced(self, part: Float64) -> Blinks:
        """Return a random part (b,), 0..1, of the blinks; each is kept whole or not at all."""
        return self.only(part > self.draws)

    @property
    def ends(self) -> Float64:
        """(b,) the seconds at which both lids are open again."""
        latest: Float64 = self.onsets + self.keys[-1] + np.abs(self.lags)
        return latest

    def at(self, times: Float64) -> Float64:
        """Return how far the left and the right lid are shut, (2, n) 0..1, at times (n,), not falling."""
        shut = np.zeros((2, len(times)))
        lids = self.onsets[:, None] + np.maximum(np.stack([-self.lags, self.lags], axis=1), 0.0)
        firsts, lasts = times.searchsorted(self.onsets).tolist(), times.searchsorted(self.ends).tolist()
        for k, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
            if first < last:
                seen = shut[:, first:last]
                closed = smooth(np.interp(times[first:last] - lids[k, :, None], self.keys[:, k], LIDS))
                np.maximum(seen, self.amounts[k] * closed, out=seen)
        return shut


@lru_cache(maxsize=64)
def blink_facts(liveliness: float) -> dict[str, float]:
    """Return the values of the section "blinks" of `idle.toml` at a liveliness."""
    pairs = idle_facts()["blinks"].items()
    return {name: still + liveliness * (alive - still) for name, (still, alive) in pairs}


def blinks_between(
    start: float, end: float, seed: int, occasions: Occasions = NOTHING, liveliness: float = 0.0
) -> Blinks:
    """Return the blinks visible in start..end, seconds on the session clock; the first is after 0.

    They depend on the seed of the character and `liveliness` 0..1; occasions move some, or add some.
    """
    limits, moves = idle_facts()["blink_limits"], prosody_facts()["blinks"]
    reach = limits["longest"] + moves["reach"] + moves["delay"]
    count = 64
    while (drawn := _draws(seed, count, liveliness))[0, -1] <= end + reach:
        count *= 2
    first, last = drawn[0].searchsorted((start - reach, end + reach), "right").tolist()
    first = max(first - 1, 0)  # it may wait for what the next one waits for
    onsets, draws, late = drawn[:, first:last]
    blinks = Blinks(onsets, draws, *_shapes(seed, first, last, liveliness))
    if occasions is not NOTHING:
        due = [_due(*one, occasions, liveliness) for one in zip(onsets.tolist(), late.tolist(), strict=True)]
        waits = [target for target, _ in due]
        further = _further(start - limits["longest"], end, seed, occasions, set(waits), liveliness)
        onsets = np.array([onset for _, onset in due])
        kept = np.array([not k or at is None or at != waits[k - 1] for k, at in enumerate(waits)], bool)
        for onset in further.onsets.tolist():
            kept &= (onsets <= onset) | (onsets >= onset + limits["clear"])
        blinks = replace(blinks, onsets=onsets).only(kept).together(further)
    return blinks.only((blinks.ends >= start) & (blinks.onsets <= end))


def _due(at: float, late: float, occasions: Occasions, liveliness: float) -> tuple[float | None, float]:
    """Return the moment that a blink due `at` waits for, or None, and its onset.

    It waits for the nearest end of a phrase of a speech that has begun by then, or else of a long fixation.
    No blink depends on later ones, so that past blinks can be forgotten.
    """
    moves, limits = prosody_facts()["blinks"], idle_facts()["blink_limits"]
    first = bisect_left(occasions.ends, at - moves["reach"], key=lambda end: end.at)
    last = bisect_left(occasions.ends, at + moves["reach"], lo=first, key=lambda end: end.at)
    near = [end for end in occasions.ends[first:last] if end.since <= at]
    if near:
        # A later speech must not move a blink that may have been shown.
        best = min(near, key=lambda end: (end.since, abs(end.at - at)))
        return best.at, best.at + late * float(moves["delay"])
    if late < blink_facts(liveliness)["fixation"]:
        first, last = np.searchsorted(occasions.saccades, (at - limits["near"], at + limits["near"])).tolist()
        saccades = occasions.saccades[max(first - 1, 0) : last]
        long = saccades[1:][np.diff(saccades) > limits["fixation"]]
        if len(long):
            return float(long[0]), float(long[0])
    return None, at


def _further(
    start: float, end: float, seed: int, occasions: Occasions, taken: set[float | None], liveliness: float
) -> Blinks:
    """Return blinks at the ends of phrases that no blink has `taken`, and at gaze shifts."""
    facts, (least, most) = blink_facts(liveliness), idle_facts()["blink_limits"]["shift"]
    delay = float(prosody_facts()["blinks"]["delay"])
    found = [(e.at, facts["phrase"], delay) for e in occasions.ends if e.at not in taken]
    sizes = ((shift.at, (shift.degrees - least) / (most - least)) for shift in occasions.shifts)
    found += [(at, facts["shift"] * min(part, 1.0), 0.0) for at, part in sizes if part > 0.0]
    at, chances, delays = np.array([one for one in found if start - delay <= one[0] <= end]).reshape(-1, 3).T
    numbers = np.round(at * 1000.0).astype(np.int64)
    chance, draws, late = uniform(seed, range(FURTHER - 3, FURTHER), numbers)
    blinks = Blinks(at + late * delays, draws, *_shape(seed, FURTHER, numbers, liveliness))
    return blinks.only(chance < chances)


@lru_cache(maxsize=256)
def _shapes(seed: int, first: int, last: int, liveliness: float) -> tuple[Float64, Float64, Float64]:
    return _shape(seed, NUMBERED, np.arange(first, last), liveliness)


def _shape(seed: int, kind: int, numbers: Index, liveliness: float) -> tuple[Float64, Float64, Float64]:
    facts, limits = blink_facts(liveliness), idle_facts()["blink_limits"]
    *length, partial, amount, lag = uniform(seed, range(kind, kind + 6), numbers)
    # The sum of three draws is nearly normal; its standard deviation is a half.
    lengths = np.clip(1.0 + facts["vary"] * 2.0 * (sum(length) - 1.5), 0.5, 1.5)
    keys = np.array([0.0, facts["closed"], facts["opens"], facts["ends"]])[:, None] * lengths
    least, most = limits["partly"]
    amounts = np.where(partial < facts["partial"], least + (most - least) * amount, 1.0)
    side = 2.0 * lag - 1.0
    return keys, amounts, facts["lag"] * np.copysign((1.0 + 2.0 * np.abs(side)) / 3.0, side)


@lru_cache(maxsize=64)
def _draws(seed: int, count: int, liveliness: float) -> Float64:
    """Return (3, count) for the first blinks: rising seconds at which they are due, two random numbers."""
    facts, (least, most) = blink_facts(liveliness), idle_facts()["blink_limits"]["again"]
    normal, turn, draw, late, again, soon = uniform(seed, (301, 302, 304, 305, 307, 308), np.arange(count))
    # Box-Muller: two uniform numbers make a normal one.
    normal = np.sqrt(-2.0 * np.log1p(-normal)) * np.cos(2.0 * np.pi * turn)
    gaps = np.clip(facts["median"] * np.exp(facts["spread"] * normal), facts["least"], facts["most"])
    gaps = np.where(again < facts["double"], least + (most - least) * soon, gaps)
    gaps[0] *= uniform(seed, 303, np.arange(1))[0]  # so that not all characters blink first at the same time
    return np.stack([np.cumsum(gaps), draw, late])


# AUs that turn eyes or head -> direction on the plane: left and up are positive.
TURNS = {51: 1, 52: -1, 61: 1, 62: -1, 53: 1j, 54: -1j, 63: 1j, 64: -1j}
STILL = 0.01  # degrees
SHOWN = 2.0  # s after its begin, in which a shift may matter


def gaze_shifts(channels: Iterable[Channel], start: float, end: float) -> list[GazeShift]:
    """Return the shifts of eyes and head together that begin from shortly before `start` until `end`.

    Channels of one gaze or gaze shift share their key times.
    """
    turns = dict[int, tuple[list[float], list[complex]]]()
    for channel in work.counted(channels):
        if channel.layer in (Layer.GAZE, Layer.BASE) and (most := _degrees().get(channel.target.column)):
            keys = channel.times
            if keys[-1] >= start - SHOWN:
                times, turn = turns.get(id(keys)) or (keys.tolist(), [0j] * len(keys))
                values = zip(turn, channel.values.tolist(), strict=True)
                turns[id(keys)] = times, [before + most * value for before, value in values]
    found = [shift for times, turn in turns.values() for shift in _shifts(times, turn)]
    return sorted(shift for shift in found if start - SHOWN <= shift.at <= end)


def _shifts(times: list[float], turn: list[complex]) -> Iterator[GazeShift]:
    """Yield the shifts of a gaze: from a key where it rests to the next one."""
    rest = 0
    for k in range(1, len(times)):
        moves = abs(turn[k] - turn[k - 1]) > STILL
        if not moves or k == len(times) - 1:
            to = k if moves else k - 1
            if to > rest:
                yield GazeShift(times[rest], abs(turn[to] - turn[rest]))
            rest = k


@cache
def _degrees() -> dict[int, complex]:
    """Return the turn at full intensity, in degrees, of each column that turns eyes or head."""
    return {au(number)[0].column: way * tables.by_number()[number].degrees for number, way in TURNS.items()}
