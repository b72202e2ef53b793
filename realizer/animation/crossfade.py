"""Crossfades from channels to their replacements, without a jump."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from realizer.animation.channel import Channel, Crossfade
from realizer.animation.curves import sample, weights

# s until a crossfade has ended: about the attack of an expression.
DURATION = 0.3
# s; keys that differ by less are equal but for rounding in the scheduler.
TOLERANCE = 1e-9
# s over which a slope is measured.
STEP = 1e-4


def crossfade(old: Sequence[Channel], new: Sequence[Channel], now: float) -> tuple[Channel, ...]:
    """Replace channels at `now` without a jump in value or velocity, and return all channels.

    Args:
        old: the channels of one behaviour; those that were replaced before stay as they are.
        new: the channels of the same behaviour at other times; they inherit the gains of the old ones.
    """
    kept = [c for c in old if c.until < float("inf")]
    playing = [c for c in old if c.until == float("inf")]
    # When a speech grows, most of its channels stay equal.
    comparable = {(id(c.values), c.target): c for c in playing if c.crossfade is None and not c.gains}
    unchanged: set[int] = set()
    pending: list[Channel] = []
    for channel in new:
        previous = comparable.get((id(channel.values), channel.target))
        if previous is not None and np.abs(previous.times - channel.times).max() < TOLERANCE:
            unchanged.add(id(previous))
        else:
            pending.append(channel)
    kept += [c for c in playing if id(c) in unchanged]
    playing = [c for c in playing if id(c) not in unchanged]
    pairs = [(c, _twin(c, n, playing, pending)) for n, c in enumerate(playing)]
    follow = [(c, replace(twin, gains=c.gains)) for c, twin in pairs if twin is not None]
    unmatched = [c.faded(now, now + DURATION) for c, twin in pairs if twin is None]
    matched = {id(twin) for _, twin in pairs}
    fresh = [c for c in pending if id(c) not in matched]
    if not follow:
        return (*kept, *unmatched, *fresh)
    before, after = (list(side) for side in zip(*follow, strict=True))
    shown = sample([*before, *after], np.array([now, now + STEP])).reshape(2, len(follow), 2)
    value, ahead = (shown[0] - shown[1]).T
    present = weights([*before, *after], np.array([now])).reshape(2, len(follow))
    continued = [
        replace(c, crossfade=Crossfade(now, float(v), float((a - v) / STEP), DURATION, float(share)))
        for c, v, a, share in zip(after, value, ahead, present[0] - present[1], strict=True)
    ]
    return (*kept, *(replace(c, until=now) for c in before), *continued, *unmatched, *fresh)


def _twin(channel: Channel, n: int, old: Sequence[Channel], new: Sequence[Channel]) -> Channel | None:
    """Return the new channel with the same target and the same rank among those of this target."""
    place = sum(c.target == channel.target for c in old[:n])
    same = [c for c in new if c.target == channel.target]
    return same[place] if place < len(same) else None
