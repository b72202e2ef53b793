"""The slow motion of a living face: breathing, posture, small movements of single muscles, swallows.

It is a function of (seed, time) alone, computed at fixed instants in batches, so that any two windows of time
agree where they overlap, and interpolated for frames.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np

from realizer.animation.axis import au
from realizer.animation.curves import smooth
from realizer.animation.idle.blinks import idle_facts
from realizer.animation.idle.motion import motion_columns, turned
from realizer.animation.idle.rng import uniform
from realizer.core.array_types import Float64, Index

# Instants a second, instants of a batch (32 s, 130 kB), and batches that are cached.
RATE, BATCH, CACHED = 16, 512, 128
# Direction of head rotation: AUs of head and eyes (negative, positive); the eyes keep their direction.
TURNS = {"yaw": ((52, 51), (61, 62)), "pitch": ((54, 53), (63, 64)), "roll": ((56, 55), ())}
# First kinds of random numbers.
DRIFT, POSTURE, RHYTHM, BREATH, TONE, SMALL, SWALLOW = 500, 530, 540, 541, 550, 600, 690


@dataclass(frozen=True, eq=False)
class Life:
    """Slow motion in a span of time."""

    # (f,) the columns beside those of head and eyes; they yield to what a document shows in them
    face: tuple[int, ...]
    first: int  # the number of the first instant
    # values, steps: (m + f, k) 0..1 the columns of `Motion` and these at each instant, and their differences
    # to the next one
    values: Float64
    steps: Float64

    def at(self, times: Float64) -> tuple[Float64, Float64]:
        """Return head and eyes, (m, n), and the other columns, (f, n), at times (n,) within the span."""
        passed = times * RATE
        numbers = np.floor(passed)
        passed -= numbers
        at = numbers.astype(np.intp) - self.first
        found: Float64 = self.steps.take(at, axis=1)
        found *= passed
        found += self.values.take(at, axis=1)
        return found[: -len(self.face)], found[-len(self.face) :]


def life_between(start: float, end: float, seed: int, liveliness: float) -> Life:
    """Return the slow motion from start to end, seconds on the session clock; `liveliness` 0..1 scales it."""
    first, last = math.floor(start * RATE) // BATCH, math.floor(end * RATE) // BATCH + 1
    return _life(seed, first, last, liveliness)


@cache
def face_columns(number: int) -> tuple[int, ...]:
    """Return the columns of an AU, left before right."""
    return tuple(target.column for target in au(number))


@cache
def _columns() -> tuple[int, ...]:
    numbers = [*_small(), 38, *(number for name in ("swallow", "trace") for number in _units(name))]
    return tuple(column for number in dict.fromkeys(numbers) for column in face_columns(number))


def _small() -> list[int]:
    return list(dict.fromkeys(number for group in idle_facts()["small"]["units"] for number in group))


def _units(section: str) -> Mapping[int, float]:
    facts = idle_facts()[section]
    return {int(number): amount for number, amount in facts.get("units", facts).items()}


@lru_cache(maxsize=CACHED)
def _life(seed: int, first: int, last: int, liveliness: float) -> Life:
    facts, times = idle_facts(), np.arange(first * BATCH, last * BATCH + 1) / RATE
    row = {column: k for k, column in enumerate((*motion_columns(), *_columns()))}
    values = np.zeros((len(row), len(times)))
    breath, nostrils = _breathing(seed, times)
    swallow = _events(seed, SWALLOW, facts["swallow"], times, 1)[0][0]
    degrees = _drift(seed, times)
    degrees["pitch"] += facts["breathing"]["pitch"] * breath + facts["swallow"]["pitch"] * swallow
    for sides, turn in ((sides, degrees[way]) for way, both in TURNS.items() for sides in both):
        for column, part in turned(sides, turn):
            values[row[column]] = part
    tone, toned = facts["tone"], [row[column] for number in _small() for column in face_columns(number)]
    noise = _noise(seed, range(TONE, TONE + len(toned)), times, tone["every"])
    values[toned] = tone["most"] * (0.55 + 0.45 * noise)
    even = [(38, nostrils), *((number, amount * swallow) for number, amount in _units("swallow").items())]
    shown = [(column, amount) for number, amount in even for column in face_columns(number)]
    for column, amount in (*shown, *_small_movements(seed, times)):
        np.maximum(values[row[column]], amount, out=values[row[column]])
    values *= liveliness
    return Life(_columns(), first * BATCH, values[:, :-1], np.diff(values))


def _small_movements(seed: int, times: Float64) -> Iterator[tuple[int, Float64]]:
    """Yield the columns and amounts (k,) of small movements."""
    facts = idle_facts()["small"]
    amounts, parts = _events(seed, SMALL, facts, times, len(facts["units"]))
    for k, group in enumerate(facts["units"]):
        for columns in map(face_columns, group):
            for column, part in zip(columns, parts[k] if len(columns) > 1 else (1.0,), strict=True):
                yield column, part * amounts[k]


def _noise(seed: int, kinds: range, times: Float64, period: float) -> Float64:
    """Return smooth noise, (m, k) -1..1, with a new value every `period` seconds."""
    passed = times / period
    numbers = np.floor(passed).astype(np.int64)
    values = 2.0 * uniform(seed, kinds, np.arange(numbers[0], numbers[-1] + 2)) - 1.0
    at = numbers - numbers[0]
    return values[:, at] + np.diff(values)[:, at] * smooth(passed - numbers)


def _drift(seed: int, times: Float64) -> dict[str, Float64]:
    """Return the head's degrees, (k,) by direction, of drift and of changes of posture."""
    facts, posture = idle_facts()["drift"], idle_facts()["posture"]
    kinds = [range(DRIFT + 3 * k, DRIFT + 3 * k + 3) for k in range(len(facts["periods"]))]
    octaves = zip(kinds, facts["periods"], strict=True)
    drift = np.sum([_noise(seed, kind, times, period) for kind, period in octaves], axis=0)
    passed = times / posture["every"]
    numbers = np.floor(passed).astype(np.int64)
    draws = uniform(seed, range(POSTURE, POSTURE + 5), np.arange(numbers[0] - 1, numbers[-1] + 1))
    late, long, *poses = draws[:, numbers - numbers[0] + 1]
    before = 2.0 * draws[2:, numbers - numbers[0]] - 1.0
    least, most = posture["takes"]
    begun = (passed - numbers - 0.9 * late) * posture["every"]
    moved = smooth(np.clip(begun / (least + (most - least) * long), 0.0, 1.0))
    shifts = before + (2.0 * np.array(poses) - 1.0 - before) * moved
    return {way: facts[way] * drift[k] + posture[way] * shifts[k] for k, way in enumerate(TURNS)}


def _breathing(seed: int, times: Float64) -> tuple[Float64, Float64]:
    """Return how full the lungs are, (k,) about 0..1, and AU38."""
    facts = idle_facts()["breathing"]
    least, most = facts["period"]
    period = least + (most - least) * float(uniform(seed, BREATH, np.zeros(1, np.int64))[0])
    (rhythm,) = _noise(seed, range(RHYTHM, RHYTHM + 1), times, facts["over"])
    passed = times / period + facts["uneven"] * rhythm
    numbers = np.floor(passed).astype(np.int64)
    depth = 1.0 - facts["vary"] + 2.0 * facts["vary"] * uniform(seed, BREATH + 1, numbers)
    part = passed - numbers
    inhaled = np.clip(part / facts["inhale"], 0.0, 1.0)
    exhaled = np.clip((part - facts["inhale"]) / facts["exhale"], 0.0, 1.0)
    # Nostrils are widest in the middle of breathing in.
    nostrils = depth * facts["nostrils"] * 4.0 * inhaled * (1.0 - inhaled)
    return depth * (smooth(inhaled) - smooth(exhaled)), nostrils


def _events(
    seed: int, kind: int, facts: Mapping[str, Any], times: Float64, count: int
) -> tuple[Float64, Float64]:
    """Return movements of `count` kinds, each at most once in `every` seconds of its own.

    They are (count, k) amounts, and (count, 2, k) 0..1 the part of them that the left and the right side
    show.
    """
    offsets = np.arange(count)[:, None] / count
    passed = times / facts["every"] + offsets
    numbers = np.floor(passed).astype(np.int64)
    drawn = np.arange(numbers.min(), numbers.max() + 1)
    shown, late, size, rise, hold, fall, side = (
        uniform(seed, range(kind, kind + 7 * count), drawn).reshape(count, 7, -1).transpose(1, 0, 2)
    )
    at: tuple[Index, Index] = np.arange(count)[:, None], numbers - drawn[0]
    sizes, rises, holds, falls = (
        (facts[name][0] + (facts[name][1] - facts[name][0]) * draw)[at]
        for name, draw in (("most", size), ("rise", rise), ("hold", hold), ("fall", fall))
    )
    sizes = np.where(shown[at] < facts["chance"], sizes, 0.0)
    begun = (passed - numbers - 0.5 * late[at]) * facts["every"]
    up = smooth(np.clip(begun / rises, 0.0, 1.0))
    down = smooth(np.clip((begun - rises - holds) / falls, 0.0, 1.0))
    weaker = facts.get("apart", 0.0) * (2.0 * side[at] - 1.0)
    return sizes * (up - down), np.stack([1.0 - np.maximum(weaker, 0), 1.0 + np.minimum(weaker, 0)], axis=1)
