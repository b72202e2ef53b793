"""The value of step 4: one target's key times and values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from realizer.animation.targets import Target
from realizer.arrays import Float64

__all__ = ["Channel", "Layer"]


class Layer(IntEnum):
    """Bottom up: where a channel is blended; `animation.blend` says what each layer does to those below."""

    BASE = 0  # mood, *Shift
    IDLE = 1  # blinks, small head motion
    EXPRESSION = 2
    GAZE = 3
    HEAD = 4
    SPEECH = 5
    DIRECT = 6  # AU and FAP values set by a client


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
        holds: the last value stays for ever (base states); otherwise the channel is 0 outside its keys.
        fade: (begin, end) seconds: from begin to end it is faded to 0, smoothly; used when a behaviour
            is cut off or a base state is replaced. Value and velocity do not jump.
        source: "block:behaviour" that made it, for messages.
    """

    target: Target
    times: Float64
    values: Float64
    curve: str = "smooth"
    layer: Layer = Layer.EXPRESSION
    holds: bool = False
    fade: tuple[float, float] | None = None
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", np.asarray(self.times, np.float64))
        object.__setattr__(self, "values", np.asarray(self.values, np.float64))
        if self.times.shape != self.values.shape or self.times.ndim != 1 or not len(self.times):
            raise ValueError(
                f"times and values: wanted two (k,), got {self.times.shape} and {self.values.shape}"
            )

    def shifted(self, seconds: float) -> Channel:
        """The same channel, later by `seconds`."""
        fade = None if self.fade is None else (self.fade[0] + seconds, self.fade[1] + seconds)
        return replace(self, times=self.times + seconds, fade=fade)

    def faded(self, begin: float, end: float) -> Channel:
        """The same channel faded out from `begin` to `end`; an earlier fade stays as it is."""
        if self.fade is not None and self.fade[1] <= end:
            return self
        return replace(self, fade=(begin, end))

    @property
    def span(self) -> tuple[float, float]:
        """(first, last) seconds at which it may be other than 0; last is infinite where it holds."""
        last = float("inf") if self.holds else float(self.times[-1])
        return float(self.times[0]), min(last, self.fade[1]) if self.fade else last
