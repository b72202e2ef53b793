"""Detection of speech by loudness in sound that arrives in pieces."""

from __future__ import annotations

from enum import Enum, auto

import numpy as np

from realizer import tables
from realizer.core.array_types import Int16

FRAME = 0.02  # s


class Turn(Enum):
    """What somebody who is heard does."""

    BEGINS = auto()
    PAUSES = auto()
    ENDS = auto()


class VoiceActivity:
    """Tells when somebody begins to speak, pauses and ends, whatever the pieces of the sound are.

    Sound is a voice where it is louder than the background, which is followed quickly down and slowly up.

    Args:
        rate: Hz of the sound.
    """

    def __init__(self, rate: int) -> None:
        self.rate = rate
        self._facts = tables.toml_table("listening.toml")["voice"]
        self._length = max(1, round(FRAME * rate))
        self._rest = np.zeros(0, np.int16)
        self._background = float(self._facts["background"])
        self._loud = self._quiet = 0  # frames in a row
        self._speaks = False

    def add(self, sound: Int16) -> list[Turn]:
        """Return what has happened in the next piece of sound, (n,) mono, in order."""
        sound = np.concatenate([self._rest, sound])
        count = len(sound) // self._length
        self._rest = sound[count * self._length :]
        frames = sound[: count * self._length].reshape(count, self._length).astype(np.float64)
        levels = np.sqrt(np.square(frames - frames.mean(axis=1, keepdims=True)).mean(axis=1))
        return [turn for level in levels.tolist() if (turn := self._advance(level)) is not None]

    def end(self) -> list[Turn]:
        """Return what the end of the sound means."""
        return [Turn.ENDS] if self._speaks else []

    def _advance(self, level: float) -> Turn | None:
        facts = self._facts
        self._background = min(level, self._background * 10.0 ** (facts["rise"] * FRAME / 20.0))
        self._background = max(self._background, facts["least"])
        if level > self._background * 10.0 ** (facts["above"] / 20.0):
            self._loud, self._quiet = self._loud + 1, 0
            if not self._speaks and self._loud == round(facts["begins"] / FRAME):
                self._speaks = True
                return Turn.BEGINS
            return None
        self._loud, self._quiet = 0, self._quiet + 1
        if self._speaks and self._quiet == round(facts["ends"] / FRAME):
            self._speaks = False
            return Turn.ENDS
        if self._speaks and self._quiet == round(facts["pauses"] / FRAME):
            return Turn.PAUSES
        return None
