"""AU channels that rise to a pose and relax or stay, follow keys, or vary as those of people do."""

import zlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, lru_cache, partial
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, Target, au
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.rng import uniform
from realizer.behaviours.kind import Fault, PlanningContext
from realizer.core.array_types import Float64, Index
from realizer.core.similar import did_you_mean, similar


def columns(aus: Mapping[tuple[int, str], float], amount: float) -> dict[Target, float]:
    """Return column -> intensity, at most 1, of {(AU, side): intensity at amount 1}."""
    values: dict[Target, float] = {}
    for (number, side), intensity in aus.items():
        for target in au(number, side):
            values[target] = max(values.get(target, 0.0), min(amount * intensity, 1.0))
    return values


def hold(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Return channels that are 0 at start and end, and constant from attackPeak to relax: times (4,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value, value, 0.0]), source=source)
        for target, value in values.items()
        if value
    )


def keep_base(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Return channels of a base state that rise from start to end, and stay: times (2,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value]), layer=Layer.BASE, keeps_last=True, source=source)
        for target, value in values.items()
    )


def unknown_word(attribute: str, word: str, known: Iterable[str]) -> Fault:
    """Return the fault of an unknown word, with similar known ones."""
    names = {name.upper(): name for name in known}
    got = word if len(word) <= 60 else word[:60] + "..."
    # Of names such as "template:grief" only the last part is compared.
    family, _, part = got.upper().rpartition(":")
    parts = {name.rpartition(":")[2]: name for name in names if name.rpartition(":")[0] == family}
    hint = did_you_mean(names[parts[name]] for name in similar(part, parts))
    wanted = f"{attribute}: wanted one of {', '.join(names.values())}"
    return Fault("CANNOT_CREATE_BEHAVIOR", f"{wanted}; got {got!r}{hint}")


# s; duration of the ease of a track that does not begin or end at rest, at most half of the track.
EASE = 0.12
# The part of its greatest value up to which an end counts as at rest, so that recordings play unchanged.
AT_REST = 0.05


def track(target: Target, times: Float64, values: Float64, source: str) -> Channel:
    """Return a channel with keys (k,), linear between them; one of a FAP overrides lower layers."""
    ease = min(EASE, float(times[-1] - times[0]) / 2)
    most = AT_REST * float(np.abs(values).max())
    first, last = abs(float(values[0])), abs(float(values[-1]))
    if first > most and ease > 0:
        times, values = _eased(times, values, ease)
    if last > most and ease > 0:
        back, turned = _eased(-times[::-1], values[::-1], ease)
        times, values = -back[::-1], turned[::-1]
    if not 0 <= target.column - len(AU_NAMES()) < 68 or ease <= 0:
        return Channel(target, times, values, curve="linear", source=source)
    # Its weight eases too, because the face below it may not be at rest.
    ends = np.array([times[0], times[0] + ease, times[-1] - ease, times[-1]])
    keys = np.unique(np.concatenate([times, ends]))
    weight = np.interp(keys, ends, [0.0, 1.0, 1.0, 0.0])
    values = np.interp(keys, times, values)
    return Channel(target, keys, values, curve="linear", layer=Layer.FAPS, weight=weight, source=source)


def _eased(times: Float64, values: Float64, ease: float) -> tuple[Float64, Float64]:
    """Return keys that start at 0 and reach the given curve `ease` seconds later."""
    reached = times[0] + ease
    later = times > reached
    joined = float(np.interp(reached, times, values))
    return (
        np.concatenate([[times[0], reached], times[later]]),
        np.concatenate([[0.0, joined], values[later]]),
    )


expression_facts = partial(tables.toml_table, "expression_motion.toml")
# Kinds of random numbers: a face's stronger side, whether it is that of an expression, by how much the other
# one is weaker, how much earlier it is, depth and turning points of the drift.
HABIT, SIDE, WEAKER, LEAD, DEPTH, TURN = range(9100, 9106)
MOST_TURNS = 60  # parts of a hold, between turning points


def express(channels: Sequence[Channel], context: PlanningContext) -> tuple[Channel, ...]:
    """Return the channels of one expression as a living face shows them; unchanged at a liveliness of 0.

    The latest AU peaks at attackPeak, the first one begins to fall at relax, and no value grows. Random
    numbers depend on the seed, the behaviour's id and the AU, so that the same document looks the same. All
    channels have the same keys: start, attackPeak, possibly others, relax, end.
    """
    if not channels or context.liveliness <= 0.0:
        return tuple(channels)
    stagger, amount = expression_facts()["stagger"], context.liveliness
    which = _aus(tuple(channel.target.name for channel in channels))
    keys = np.tile(channels[0].times, (len(channels), 1))
    start, peak, relax, end = keys[0, [0, 1, -2, -1]].tolist()
    onset = min(amount * stagger["onset"], stagger["share"] * (peak - start))
    offset = min(amount * stagger["offset"], stagger["share"] * (end - relax))
    id = zlib.crc32(channels[0].source.encode())
    factors, leads = _sides(which, id, context)
    values = np.array([channel.values for channel in channels]) * factors[:, None]
    keys[:, 0] += which.places * onset
    keys[:, 1] -= (1.0 - which.places) * onset + np.minimum(leads, stagger["share"] * (peak - start) - onset)
    keys[:, -2] += which.places * offset
    keys[:, -1] -= (1.0 - which.places) * offset
    if (count := min(int((relax - peak) / expression_facts()["hold"]["every"]), MOST_TURNS)) > 1:
        keys, values = _drifting(keys, values, count, amount * which.drifts, context.seed, id)
    return tuple(
        channel.changed({"times": own, "values": shown})
        for channel, own, shown in zip(channels, keys, values, strict=True)
    )


@cache
def order() -> Mapping[int, float]:
    """Return AU -> its place in the order of onsets, from 0 for the first to 1 for the last of all."""
    groups = expression_facts()["stagger"]["order"]
    return {au: rank / (len(groups) - 1) for rank, aus in enumerate(groups) for au in aus}


class _Aus(NamedTuple):
    """The AUs of an expression."""

    numbers: Index  # (n + 1,) 0, for the face itself, and the number of each
    places: Float64  # (n,) in the order of onsets, from 0 for the first to 1 for the last of these
    sides: Float64  # (n,) 1 for the left, -1 for the right one of a pair whose sides differ, otherwise 0
    drifts: Float64  # (n,) 1 for those whose hold drifts, otherwise 0


@lru_cache(maxsize=512)
def _aus(names: tuple[str, ...]) -> _Aus:
    """Return the facts about AUs that do not depend on a face."""
    numbers = np.array([int(name.rstrip("LR")) for name in names])
    places = np.array([order().get(au, 0.5) for au in numbers.tolist()])
    places -= places.min()
    places = places / most if (most := places.max()) > 0.0 else np.ones(len(places))
    drifts = np.isin(numbers, expression_facts()["asymmetry"]["even"], invert=True).astype(np.float64)
    paired = np.array([{f"{au}L", f"{au}R"} <= {*names} for au in numbers.tolist()])
    sides = drifts * paired * [1.0 if name.endswith("L") else -1.0 for name in names]
    return _Aus(np.concatenate([[0], numbers]), places, sides, drifts)


def _sides(which: _Aus, id: int, context: PlanningContext) -> tuple[Float64, Float64]:
    """Return the factor of each AU's value, and by how many seconds it is early, since sides differ."""
    facts = expression_facts()["asymmetry"]
    side, chance, early = uniform(context.seed, (SIDE, WEAKER, LEAD), id + which.numbers)
    strong = which.sides if (side[0] < facts["habit"]) == _is_left_habitual(context.seed) else -which.sides
    less = facts["least"] + (facts["most"] - facts["least"]) * chance[1:]
    lead = facts["lead_least"] + (facts["lead_most"] - facts["lead_least"]) * early[1:]
    return 1.0 - context.liveliness * less * (strong < 0), context.liveliness * lead * (strong > 0)


@lru_cache(maxsize=256)
def _is_left_habitual(seed: int) -> bool:
    return bool(uniform(seed, HABIT, np.zeros(1, np.int64))[0] < 0.5)


def _drifting(
    keys: Float64, values: Float64, count: int, depths: Float64, seed: int, id: int
) -> tuple[Float64, Float64]:
    """Return keys and values, (n, k + count - 1), with turning points in the hold that lower the held value.

    Turning points divide the hold into `count` parts; `depths`, (n,) 0..1, scale the drift of each AU.
    """
    facts, turns = expression_facts()["hold"], np.arange(1, count)
    numbers = id + MOST_TURNS * np.arange(len(keys))[:, None] + turns
    depth, late = uniform(seed, (DEPTH, TURN), numbers.ravel()).reshape(2, *numbers.shape)
    # Turning points between the two ends are low and high in turn, at uneven distances.
    depth = (facts["least"] + (facts["drift"] - facts["least"]) * depth) * np.where(turns % 2, 1.0, 0.2)
    begin, end, held = keys[:, -3:-2], keys[:, -2:-1], values[:, -2:-1]
    between = begin + (end - begin) * (turns + 0.3 * (late - 0.5)) / count
    lower = held * (1.0 - depths[:, None] * depth)
    return (
        np.concatenate([keys[:, :-2], between, keys[:, -2:]], axis=1),
        np.concatenate([values[:, :-2], lower, values[:, -2:]], axis=1),
    )
