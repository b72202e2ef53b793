"""Lips that open further or less than usual."""

from functools import cache
from weakref import WeakKeyDictionary

import numpy as np

from realizer.animation.axis import Target, fap
from realizer.animation.channel import Channel

# FAPs that open the mouth, and the sign that they have then.
OPENING = {3: 1.0} | dict.fromkeys((4, 5, *range(8, 12), 51, 52, *range(55, 59)), -1.0)

# First channel -> factor and result. Windows of frames ask for the same ones again and again.
_known: WeakKeyDictionary[Channel, tuple[float, tuple[Channel, ...]]] = WeakKeyDictionary()


def opened(channels: tuple[Channel, ...], factor: float) -> tuple[Channel, ...]:
    """Return the channels of a speech whose lips and jaw open by a factor; closures and bites stay.

    Args:
        channels: of `lip_channels`, at least one.
    """
    if factor == 1.0:
        return channels
    known = _known.get(channels[0])
    if known is None or known[0] != factor:
        known = _known[channels[0]] = factor, tuple(_opened(channel, factor) for channel in channels)
    return known[1]


def _opened(channel: Channel, factor: float) -> Channel:
    sign = _signs().get(channel.target)
    if sign is None:
        return channel
    # Where it opens the mouth, the scaled value is the outer one if the factor is above 1; elsewhere not.
    choice = np.maximum if (factor > 1.0) == (sign > 0) else np.minimum
    return channel.changed({"values": choice(channel.values, factor * channel.values)})


@cache
def _signs() -> dict[Target, float]:
    return {fap(number): sign for number, sign in OPENING.items()}
