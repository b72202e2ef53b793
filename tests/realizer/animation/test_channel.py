"""Channels."""

import numpy as np
import pytest

from realizer.animation.axis import au
from realizer.animation.channel import Channel, Crossfade, Gain, Layer, later

KEYS = np.array([0.0, 0.5, 1.0])


def channel(**more: object) -> Channel:
    return Channel(au(12)[0], KEYS, np.array([0.0, 1.0, 0.0]), source="s", **more)  # type: ignore[arg-type]


def test_channel_shifts_all_times_and_nothing_else() -> None:
    one = channel(
        layer=Layer.HEAD, gains=(Gain(0.5, 1.0, 0.0),), until=2.0, crossfade=Crossfade(0.25, 1.0, 0.0, 0.1)
    )
    assert one.span == (0.25, 1.0)
    (other,) = later([one], 10.0, "b:s")
    assert other.times.tolist() == [10.0, 10.5, 11.0]
    assert other.gains == (Gain(10.5, 11.0, 0.0),)
    assert (other.until, other.crossfade) == (12.0, Crossfade(10.25, 1.0, 0.0, 0.1))
    assert (other.layer, other.source, other.target) == (Layer.HEAD, "b:s", one.target)
    assert other.values is one.values
    assert other.span == (10.25, 11.0)
    assert (one.times.tolist(), one.source) == ([0.0, 0.5, 1.0], "s")


def test_later_channels_still_share_their_times() -> None:
    first, second, third = later([channel(), channel(), channel().shifted(1.0)], 2.0, "b:s")
    assert first.times is second.times
    assert third.times is not first.times
    assert third.times.tolist() == [3.0, 3.5, 4.0]


def test_channel_refuses_times_and_values_of_other_shapes() -> None:
    with pytest.raises(ValueError, match=r"wanted two \(k,\), got \(3,\) and \(2,\)"):
        Channel(au(12)[0], KEYS, np.zeros(2))
    with pytest.raises(ValueError, match="wanted two"):
        Channel(au(12)[0], np.zeros(0), np.zeros(0))
