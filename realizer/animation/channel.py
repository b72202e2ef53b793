"""Channels, the result of step 4: key times and values of one target."""

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
    """The layers in which channels are blended, bottom up; see `animation.blend`."""

    BASE = 0  # mood, *Shift
    IDLE = 1  # blinks, small head motion
    EXPRESSION = 2
    GAZE = 3
    HEAD = 4
    SPEECH = 5
    FAPS = 6  # FAPs that a document gives
    DIRECT = 7  # AU and FAP values set by a client


class Gain(NamedTuple):
    """A change of the factor of a channel or a sound: it reaches `to` between `begin` and `end` and stays."""

    begin: float
    end: float
    to: float
    curve: str = "smooth"

    def shifted(self, seconds: float) -> Gain:
        return self._replace(begin=self.begin + seconds, end=self.end + seconds)


class Crossfade(NamedTuple):
    """How a channel continues its predecessor: their difference at `at`, which decays over `length` seconds.

    `value`, `slope` (per second) and `share` are the predecessor's value, slope and weight at that time,
    minus those of this channel.
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
    """One target over time."""

    target: Target  # the column it drives
    # (k,) float64 seconds, rising; from block start when expanded, on the session clock in the player
    times: Float64
    values: Float64  # (k,) float64; AUs and mask channels 0..1, FAPs in their FAPU
    curve: str = "smooth"  # name in `animation.curves`: "smooth" (velocity zero at each key) or "linear"
    layer: Layer = Layer.EXPRESSION  # where it is blended
    # whether the last value stays for ever (base states); otherwise the channel is 0 outside its keys
    keeps_last: bool = False
    # changes of its factor, which is 1 at first: for behaviours that are interrupted, base states that are
    # replaced, and amounts that change. Each starts from the factor reached before it.
    gains: tuple[Gain, ...] = ()
    until: float = float("inf")  # seconds; the channel is 0 from then on, because another one replaces it
    crossfade: Crossfade | None = None  # set for such a replacement, which is 0 before `crossfade.at`
    # (k,) 0..1: how far it replaces the layers below, at each key; None for 1. Only for the layers FAPS and
    # DIRECT. The values are weighted already: 0 where the weight is 0.
    weight: Float64 | None = None
    source: str = ""  # "block:behaviour" that it comes from, for messages

    def __post_init__(self) -> None:
        times, values = np.asarray(self.times, np.float64), np.asarray(self.values, np.float64)
        if times.shape != values.shape or times.ndim != 1 or not len(times):
            raise ValueError(f"times and values: wanted two (k,), got {times.shape} and {values.shape}")
        if times is not self.times or values is not self.values:
            self.__dict__.update(times=times, values=values)

    def shifted(self, seconds: float) -> Channel:
        return later((self,), seconds, self.source)[0]

    def faded(self, begin: float, end: float) -> Channel:
        """Return the channel faded out from `begin` to `end`, unless it fades out earlier."""
        if self.faded_at <= end:
            return self
        return self.changed({"gains": (*self.gains, Gain(begin, end, 0.0))})

    def changed(self, changes: Mapping[str, object]) -> Channel:
        """Return a copy with changed fields; unlike `replace`, without checks, in a tenth of the time."""
        other = object.__new__(type(self))
        fields = other.__dict__
        fields.update(self.__dict__)
        fields.update(changes)
        fields.pop("span", None)
        return other

    @property
    def weight_channel(self) -> Channel:
        """The weight over time, as a channel itself."""
        weights = np.ones(len(self.times)) if self.weight is None else self.weight
        crossfade = (
            None if self.crossfade is None else self.crossfade._replace(value=self.crossfade.share, slope=0.0)
        )
        return replace(self, values=weights, crossfade=crossfade)

    @property
    def faded_at(self) -> float:
        """Seconds at which the channel has faded out for good; infinite if it has not."""
        last = self.gains[-1] if self.gains else None
        return last.end if last is not None and last.to == 0.0 else float("inf")

    @cached_property
    def span(self) -> tuple[float, float]:
        """(first, last) seconds between which it may differ from 0; last may be infinite."""
        last = float("inf") if self.keeps_last else float(self.times[-1])
        first = float(self.times[0])
        if self.crossfade is not None:
            first, last = self.crossfade.at, max(last, self.crossfade.at + self.crossfade.length)
        return first, min(last, self.faded_at, self.until)


def later(channels: Sequence[Channel], seconds: float, source: str) -> tuple[Channel, ...]:
    """Return the channels later by `seconds`, with another source; those that share key times still do."""
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
