"""The value of step 4: key times and values of one target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from realizer.animation.axis import Target
from realizer.core.array_types import Float64


class Layer(IntEnum):
    """Bottom up: where a channel is blended; `animation.blend` says what each layer does to those below."""

    BASE = 0  # mood, *Shift
    IDLE = 1  # blinks, small head motion
    EXPRESSION = 2
    GAZE = 3
    HEAD = 4
    SPEECH = 5
    FAPS = 6  # FAPs that a document gives
    DIRECT = 7  # AU and FAP values set by a client


class Gain(NamedTuple):
    """From `begin` to `end` what a channel or a sound is multiplied with goes to `to`, and stays there."""

    begin: float
    end: float
    to: float
    curve: str = "smooth"

    def shifted(self, seconds: float) -> Gain:
        """The same change, later by `seconds`."""
        return self._replace(begin=self.begin + seconds, end=self.end + seconds)


class Crossfade(NamedTuple):
    """How a channel goes on from the one before it: by what it differs at `at`, which `length` seconds heal.

    `value` and `slope` are what was shown at that time less what this channel would show, and a second of it;
    `share` is how far the one before was there less how far this one would be.
    """

    at: float
    value: float
    slope: float
    length: float
    share: float = 0.0

    def shifted(self, seconds: float) -> Crossfade:
        return self._replace(at=self.at + seconds)


@dataclass(frozen=True, eq=False)
class Channel:
    """One target over time.

    Attributes:
        target: the column it drives.
        times: (k,) float64 seconds, rising; from block start when expanded, on the session clock in the
            player.
        values: (k,) float64; AU and presence 0..1, FAP in its FAPU.
        curve: name in `animation.curves`: "smooth" (velocity zero at each key) or "linear".
        layer: where it is blended.
        keeps_last: the last value stays for ever (base states); otherwise the channel is 0 outside its keys.
        gains: what it is multiplied with, 1 before the first: where a behaviour is cut off, a base state is
            replaced or an amount changes. Each goes on from what those before it have reached, so that
            nothing jumps.
        until: it shows nothing from then on: another channel goes on in its place.
        crossfade: it is such a channel, and shows nothing before `joint.at`.
        weight: (k,) 0..1 or None: how far it takes the place of what lies below, at each key; whole where it
            is None. Only of the layers FAPS and DIRECT, whose values are what is shown, so 0 where this is 0.
        source: "block:behaviour" that made it, for messages.
    """

    target: Target
    times: Float64
    values: Float64
    curve: str = "smooth"
    layer: Layer = Layer.EXPRESSION
    keeps_last: bool = False
    gains: tuple[Gain, ...] = ()
    until: float = float("inf")
    crossfade: Crossfade | None = None
    weight: Float64 | None = None
    source: str = ""

    def __post_init__(self) -> None:
        times, values = np.asarray(self.times, np.float64), np.asarray(self.values, np.float64)
        if times.shape != values.shape or times.ndim != 1 or not len(times):
            raise ValueError(f"times and values: wanted two (k,), got {times.shape} and {values.shape}")
        if times is not self.times or values is not self.values:
            self.__dict__.update(times=times, values=values)

    def shifted(self, seconds: float) -> Channel:
        """The same channel, later by `seconds`."""
        return later((self,), seconds, self.source)[0]

    def named(self, source: str) -> Channel:
        """The same channel, made by `source`."""
        return self.changed({"source": source})

    def faded(self, begin: float, end: float) -> Channel:
        """The same channel faded out from `begin` to `end`; an earlier fade stays as it is."""
        if self.faded_at <= end:
            return self
        return self.scaled(Gain(begin, end, 0.0))

    def scaled(self, gain: Gain) -> Channel:
        """The same channel with one more gain."""
        return self.changed({"gains": (*self.gains, gain)})

    def changed(self, changes: Mapping[str, object]) -> Channel:
        """As `replace`, in a tenth of its time: what changes is as sound as what was there."""
        other = object.__new__(type(self))
        fields = other.__dict__
        fields.update(self.__dict__)
        fields.update(changes)
        fields.pop("span", None)
        return other

    @property
    def weight_channel(self) -> Channel:
        """How far it takes the place of what lies below, as a channel itself."""
        there = np.ones(len(self.times)) if self.weight is None else self.weight
        joint = (
            None if self.crossfade is None else self.crossfade._replace(value=self.crossfade.share, slope=0.0)
        )
        return replace(self, values=there, crossfade=joint)

    @property
    def faded_at(self) -> float:
        """When it has been faded out for good; infinite where it is not."""
        last = self.gains[-1] if self.gains else None
        return last.end if last is not None and last.to == 0.0 else float("inf")

    @cached_property
    def span(self) -> tuple[float, float]:
        """(first, last) seconds at which it may be other than 0; last is infinite where it holds."""
        last = float("inf") if self.keeps_last else float(self.times[-1])
        first = float(self.times[0])
        if self.crossfade is not None:
            first, last = self.crossfade.at, max(last, self.crossfade.at + self.crossfade.length)
        return first, min(last, self.faded_at, self.until)


def later(channels: Sequence[Channel], seconds: float, source: str) -> tuple[Channel, ...]:
    """The same channels later by `seconds`, made by `source`; those that share their times still do."""
    shifted: dict[int, Float64] = {}
    found = []
    for channel in channels:
        times = shifted.get(id(channel.times))
        if times is None:
            times = shifted[id(channel.times)] = channel.times + seconds
        changes: dict[str, object] = {"times": times, "until": channel.until + seconds, "source": source}
        if channel.gains:
            changes["gains"] = tuple(gain.shifted(seconds) for gain in channel.gains)
        if channel.crossfade is not None:
            changes["crossfade"] = channel.crossfade.shifted(seconds)
        found.append(channel.changed(changes))
    return tuple(found)
