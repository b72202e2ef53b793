"""How what a face shows changes the way it speaks."""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import sample
from realizer.core import work
from realizer.speech.accents import prosody_facts


class Style(NamedTuple):
    """How a feeling changes speech."""

    # size, pace: factors of the motion of the head
    size: float = 1.0
    pace: float = 1.0
    pitch: float = 0.0  # of the head, degrees
    opening: float = 1.0  # factor of the opening of the mouth


NEUTRAL = Style()
SHOWN = 0.5  # s after the start of a speech, at which its style is found


def on_style(channels: Iterable[Channel]) -> list[Channel]:
    """Return the channels on which the style of a face depends."""
    wanted = _action_units()
    return [channel for channel in work.counted(channels) if channel.target.column in wanted]


@cache
def _action_units() -> dict[int, int]:
    """Return column -> number of the action units that change speech."""
    rows = prosody_facts()["style"]
    return {target.column: number for row in rows for number in row["aus"] for target in au(number)}


def style_of(channels: Iterable[Channel], start: float) -> Style:
    """Return the style of a face that shows these channels shortly after a speech has started.

    It depends on nothing that happens later: a base state counts if it has begun before, and whatever is
    interrupted later counts as whole.
    """
    rows = prosody_facts()["style"]
    wanted = _action_units()
    active = [
        _without_later(channel, start)
        for channel in on_style(channels)
        if channel.layer is not Layer.BASE or channel.times[0] <= start
    ]
    if not active:
        return NEUTRAL
    shown: dict[int, float] = {}
    for channel, (value,) in zip(active, sample(active, np.array([start + SHOWN])).tolist(), strict=True):
        number = wanted[channel.target.column]
        shown[number] = max(shown.get(number, 0.0), value)
    size, pace, pitch, opening = NEUTRAL
    for row in rows:
        strength = min(shown.get(number, 0.0) for number in row["aus"])
        size += strength * (row["size"] - 1.0)
        pace += strength * (row["pace"] - 1.0)
        pitch += strength * row["pitch"]
        opening += strength * (row["opening"] - 1.0)
    return Style(round(size, 3), round(pace, 3), round(pitch, 3), round(opening, 3))


def _without_later(channel: Channel, start: float) -> Channel:
    gains = tuple(gain for gain in channel.gains if gain.begin <= start)
    until = channel.until if channel.until <= start else np.inf
    if (gains, until, None) == (channel.gains, channel.until, channel.crossfade):
        return channel
    return channel.changed({"gains": gains, "until": until, "crossfade": None})
