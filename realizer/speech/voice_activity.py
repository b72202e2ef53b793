"""Detection of speech by loudness, in sound that arrives in pieces and in recordings."""

from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Float64, Int16

FRAME = 0.02  # s


class Turn(Enum):
    """What somebody who is heard does."""

    BEGINS = auto()
    PAUSES = auto()
    ENDS = auto()


@dataclass(eq=False)
class VoiceActivity:
    """Tells when somebody begins to speak, pauses and ends, whatever the pieces of the sound are.

    Sound is a voice where it is louder than the background, which is followed quickly down and slowly up.
    """

    rate: int  # Hz of the sound
    # the samples after the last whole frame
    rest: Int16 = field(default_factory=lambda: np.zeros(0, np.int16))
    background: float = field(default_factory=lambda: float(_facts()["background"]))  # root mean square
    # loud, quiet: frames in a row
    loud: int = 0
    quiet: int = 0
    speaks: bool = False  # whether somebody speaks

    def add(self, sound: Int16) -> list[Turn]:
        """Return what has happened in the next piece of sound, (n,) mono, in order."""
        sound, length = np.concatenate([self.rest, sound]), max(1, round(FRAME * self.rate))
        count = len(sound) // length
        self.rest = sound[count * length :]
        levels = _levels(sound[: count * length].reshape(count, length))
        return [turn for level in levels.tolist() if (turn := self._advance(level)) is not None]

    def end(self) -> list[Turn]:
        return [Turn.ENDS] if self.speaks else []

    def _advance(self, level: float) -> Turn | None:
        facts = _facts()
        self.background = min(level, self.background * 10.0 ** (facts["rise"] * FRAME / 20.0))
        self.background = max(self.background, facts["least"])
        if level > self.background * 10.0 ** (facts["above"] / 20.0):
            self.loud, self.quiet = self.loud + 1, 0
            if not self.speaks and self.loud == round(facts["begins"] / FRAME):
                self.speaks = True
                return Turn.BEGINS
            return None
        self.loud, self.quiet = 0, self.quiet + 1
        if self.speaks and self.quiet == round(facts["ends"] / FRAME):
            self.speaks = False
            return Turn.ENDS
        if self.speaks and self.quiet == round(facts["pauses"] / FRAME):
            return Turn.PAUSES
        return None


def spans_of_voice(sound: Int16, rate: int) -> list[tuple[float, float]]:
    """Return (start, end) in seconds of the stretches of a recording that are louder than its background.

    They are without noise and hum, which are steady, and with the quiet consonants beside the loud ones.
    """
    facts = tables.toml_table("listening.toml")["recording"]
    length, duration = max(1, round(FRAME * rate)), len(sound) / rate
    if duration < facts["shortest"]:
        return [(0.0, duration)]
    levels = _levels(sound[: len(sound) // length * length].reshape(-1, length))
    background = float(np.quantile(levels, facts["background"]))
    is_loud = levels > max(facts["least"], background * 10.0 ** (facts["above"] / 20.0))
    # Frames at which it becomes loud, and quiet again.
    edges = np.flatnonzero(np.diff(is_loud, prepend=False, append=False)).reshape(-1, 2) * length / rate
    spans: list[tuple[float, float]] = []
    for start, end in edges.tolist():
        if end - start < facts["loud"] - FRAME / 2:
            continue
        start, end = max(0.0, start - facts["hold"]), min(duration, end + facts["hold"])
        if spans and start <= spans[-1][1]:
            start = spans.pop()[0]
        spans.append((start, end))
    return spans


def _levels(frames: Int16) -> Float64:
    """Return the root mean square (n,) of frames (n, samples), without their mean."""
    samples = frames.astype(np.float64)
    levels: Float64 = np.sqrt(np.square(samples - samples.mean(axis=1, keepdims=True)).mean(axis=1))
    return levels


def _facts() -> dict[str, Any]:
    facts: dict[str, Any] = tables.toml_table("listening.toml")["voice"]
    return facts
