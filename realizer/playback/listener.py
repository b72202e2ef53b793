"""The responses of a character that hears another one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bml_schema import Listen
from realizer import tables
from realizer.animation.channel import Channel
from realizer.animation.idle.blinks import OnsetMask
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.listen import expand, respond

SOURCE = "heard"


def responses(
    known: Iterable[Channel], now: float, context: PlanningContext, *, is_speaking: bool, text: str | None
) -> list[Channel]:
    """Return the channels of responses after news of the other: those that have begun, and new ones.

    The end of a piece of text calls for a response, by its last character; the end of a turn for a nod.
    While the other speaks, responses come of themselves too.

    Args:
        known: the channels of earlier responses.
        now: seconds on the session clock.
        is_speaking: whether the other speaks.
        text: what the other has said since the last news.
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
