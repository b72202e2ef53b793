"""listen, and the responses of a character that hears another one: nods, raised brows, smiles."""

import math
import zlib
from collections.abc import Iterable, Iterator

import numpy as np

from bml_schema import Listen
from realizer import tables
from realizer.animation.axis import au, mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import OnsetMask
from realizer.animation.idle.rng import uniform
from realizer.behaviours.kind import BehaviourKind, PlanningContext, table_timing
from realizer.behaviours.pose_channels import columns, express, hold
from realizer.core import work
from realizer.core.array_types import Float64

# Kinds of random numbers: interval, which response, size, number of nods.
KINDS_DRAWN = range(9200, 9204)
DOWN, EYES_UP = 54, 63


def expand(
    node: Listen, times: Float64, context: PlanningContext, *, quiet: float = 0.0
) -> tuple[Channel, ...]:
    """Return channels of the eyes and of all responses, which depend on the seed and the id.

    There is no response in the first `quiet` seconds.
    """
    facts = tables.toml_table("listening.toml")
    start, end = times.tolist()
    shares = np.cumsum(list(facts["share"].values()))
    counts = np.cumsum(facts["nod"]["counts"])
    channels: list[Channel] = []
    for begin, kind, size, count in work.counted(_responses(node, start + quiet, end, context), 20):
        name = list(facts["share"])[min(int(np.searchsorted(shares, kind)), len(shares) - 1)]
        movements = 1 + min(int(np.searchsorted(counts, count)), len(counts) - 1)
        channels += respond(name, begin, size, node.id, context, movements=movements)
    shown = tuple(channel for channel in channels if channel.times[-1] <= end)
    # With this mask the eyes stay with the speaker.
    eyes = OnsetMask(mask_channel("listening"), times, np.ones(2), layer=Layer.BASE, source=node.id)
    return (eyes, *shown) if node.intensity > 0.0 else shown


def respond(
    name: str, begin: float, size: float, source: str, context: PlanningContext, *, movements: int = 1
) -> tuple[Channel, ...]:
    """Return the channels of one response: "nod", in which the head moves down so often, "brows" or "smile".

    It begins at `begin` seconds on the clock of the channels; `size` is 0..1.
    """
    row = tables.toml_table("listening.toml")[name]
    if name != "nod":
        keys = begin + np.cumsum([0.0, row["attack"], row["hold"], row["relax"]])
        pose = columns({(int(number), "BOTH"): value for number, value in row["aus"].items()}, size)
        return express(hold(pose, keys, f"{source} {begin:.3f}"), context)
    keys = begin + row["seconds"] / 2 * np.arange(2 * movements + 1)
    degrees = np.zeros(len(keys))
    degrees[1::2] = row["degrees"] * size * row["decay"] ** np.arange(movements)
    return tuple(
        Channel(au(n)[0], keys, degrees / tables.by_number()[n].degrees, layer=Layer.HEAD, source=source)
        for n in (DOWN, EYES_UP)
    )


def _responses(
    node: Listen, start: float, end: float, context: PlanningContext
) -> Iterator[tuple[float, float, float, float]]:
    """Yield the time of each response, and random numbers: its kind, its size, how often it is repeated."""
    if node.intensity <= 0.0:
        return
    facts = tables.toml_table("listening.toml")["interval"]
    id, time, k = zlib.crc32(node.id.encode()), start, 0
    while True:
        way, kind, size, count = uniform(context.seed, list(KINDS_DRAWN), np.array([id * 65536 + k]))[:, 0]
        # The inverse of the logistic function is near enough to that of the normal distribution.
        spread = math.log(max(way, 1e-6) / max(1.0 - way, 1e-6)) / 1.7
        interval = max(facts["least"], facts["median"] * math.exp(facts["sigma"] * spread)) / node.intensity
        # Nobody responds at once.
        time += interval if k else 0.5 * interval
        if time >= end:
            return
        yield time, float(kind), node.intensity * (0.6 + 0.4 * float(size)), float(count)
        k += 1


KINDS = (BehaviourKind(Listen, table_timing("listen"), expand, parameters={"intensity": "intensity"}),)


SOURCE = "heard"


def responses(
    known: Iterable[Channel], now: float, context: PlanningContext, *, is_speaking: bool, text: str | None
) -> list[Channel]:
    """Return the channels of responses after news of the other: those `known` that have begun, and new ones.

    The end of a piece of text calls for a response, by its last character; the end of a turn for a nod.
    While the other speaks, responses come of themselves too. `text` is what the other has said since the last
    news; `now` is on the session clock.
    """
    facts = tables.toml_table("listening.toml")["heard"]
    found = [channel for channel in known if channel.times[0] <= now]
    # The eyes listen until the next news, responses that have begun go on to their end.
    found = [c.changed({"until": min(c.until, now)}) if isinstance(c, OnsetMask) else c for c in found]
    last = (text or "").rstrip()[-1:]
    name, movements = facts.get(last) or ("", 0)
    if not is_speaking and not name:
        name, movements = facts["."]
    begin = now + facts["after"]
    if name and all(min(channel.times[-1], channel.until) <= begin for channel in found):
        found += respond(name, begin, facts["size"], SOURCE, context, movements=movements)
    if is_speaking:
        node = Listen(id=f"{SOURCE} {now:.3f}", intensity=facts["intensity"])
        found += expand(node, np.array([now, now + facts["horizon"]]), context, quiet=facts["quiet"])
    return found
