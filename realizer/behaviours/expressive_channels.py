"""The motion of expressions: AUs that begin one after the other, sides that differ, holds that drift."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from functools import cache, partial

import numpy as np

from realizer import tables
from realizer.animation.channel import Channel
from realizer.animation.idle.rng import uniform
from realizer.behaviours.kind import PlanningContext
from realizer.core.array_types import Float64

expression_facts = partial(tables.toml_table, "expression_motion.toml")
# Kinds of random numbers: which side is stronger, by how much, how much earlier, depth of the drift, turning
# points of the drift.
SIDE, WEAKER, LEAD, DEPTH, TURN = range(9100, 9105)


def express(channels: Sequence[Channel], context: PlanningContext) -> tuple[Channel, ...]:
    """Return the channels of one expression as a living face shows them.

    The latest AU peaks at attackPeak, the first one begins to fall at relax, and no value grows. Random
    numbers depend on the seed, the behaviour's id and the AU, so that the same document looks the same.

    Args:
        channels: with equal keys: start, attackPeak, possibly others, relax, end.
        context: `liveliness` scales all of it; at 0, the channels are returned as they are.
    """
    if not channels or context.liveliness <= 0.0:
        return tuple(channels)
    stagger, amount = expression_facts()["stagger"], context.liveliness
    names = [channel.target.name for channel in channels]
    aus = [int(name.rstrip("LR")) for name in names]
    start, peak = channels[0].times[0], channels[0].times[1]
    relax, end = channels[0].times[-2:]
    onset = min(amount * stagger["onset"], stagger["share"] * (peak - start))
    offset = min(amount * stagger["offset"], stagger["share"] * (end - relax))
    factors, leads = _sides(names, aus, channels[0].source, context)
    leads = np.minimum(leads, stagger["share"] * (peak - start) - onset).clip(0.0)
    found = []
    for channel, au, place, factor, lead in zip(channels, aus, _places(aus), factors, leads, strict=True):
        keys, values = channel.times.copy(), channel.values * factor
        keys[0] += place * onset
        keys[1] -= (1 - place) * onset + lead
        keys[-2] += place * offset
        keys[-1] -= (1 - place) * offset
        if au not in expression_facts()["asymmetry"]["even"]:
            keys, values = _drifting(keys, values, zlib.crc32(channel.target.name.encode()), context)
        found.append(channel.changed({"times": keys, "values": values}))
    return tuple(found)


@cache
def order() -> Mapping[int, float]:
    """Return AU -> its place in the order of onsets, from 0 for the first to 1 for the last of all."""
    groups = expression_facts()["stagger"]["order"]
    return {au: rank / (len(groups) - 1) for rank, aus in enumerate(groups) for au in aus}


def _places(aus: Sequence[int]) -> Float64:
    """Return the place of each AU in the order of onsets, from 0 for the first to 1 for the last of these."""
    places = np.array([order().get(au, 0.5) for au in aus])
    places -= places.min()
    return places / most if (most := places.max()) > 0.0 else np.ones(len(places))


def _sides(
    names: Sequence[str], aus: Sequence[int], source: str, context: PlanningContext
) -> tuple[Float64, Float64]:
    """Return the factor of each AU's value, and by how many seconds it is early, since sides differ."""
    facts, whole = expression_facts()["asymmetry"], set(names)
    id = zlib.crc32(source.encode())
    chance = uniform(context.seed, (WEAKER, LEAD), id + np.array(aus))
    habit = uniform(context.seed, SIDE, np.array([0]))[0] < 0.5
    is_habitual = uniform(context.seed, SIDE, np.array([id + 1]))[0] < facts["habit"]
    strong = "L" if habit == is_habitual else "R"
    paired = np.array([au not in facts["even"] and {f"{au}L", f"{au}R"} <= whole for au in aus])
    is_strong = np.array([name.endswith(strong) for name in names])
    less = context.liveliness * (facts["least"] + (facts["most"] - facts["least"]) * chance[0])
    lead = context.liveliness * (facts["lead_least"] + (facts["lead_most"] - facts["lead_least"]) * chance[1])
    return np.where(paired & ~is_strong, 1.0 - less, 1.0), np.where(paired & is_strong, lead, 0.0)


def _drifting(
    keys: Float64, values: Float64, number: int, context: PlanningContext
) -> tuple[Float64, Float64]:
    """Return keys and values with turning points in the hold, which are lower than the held value."""
    facts, begin, end = expression_facts()["hold"], keys[-3], keys[-2]
    count = min(int((end - begin) / facts["every"]), facts["most"])
    if count < 2:
        return keys, values
    turns = number + np.arange(count)
    depth = facts["least"] + (facts["drift"] - facts["least"]) * uniform(context.seed, DEPTH, turns)
    # Turning points between the two ends are low and high in turn, at uneven distances.
    away = np.arange(1, count) + 0.3 * (uniform(context.seed, TURN, turns[1:]) - 0.5)
    between = begin + (end - begin) * away / count
    low = 1.0 - context.liveliness * depth[1:] * np.where(np.arange(1, count) % 2, 1.0, 0.2)
    return np.insert(keys, -2, between), np.insert(values, -2, values[-2] * low)
