"""Utterances on the session clock."""

from __future__ import annotations

from dataclasses import dataclass

from realizer.animation.channel import Gain
from realizer.speech.utterance import Utterance

# Sound and lips stop faster than a face relaxes, so that an interruption is heard at once.
SPEECH_FADE = 0.12  # s
# A word that lacks no more than this was heard completely.
HEARD = 1e-4  # s


@dataclass(frozen=True, eq=False)
class ScheduledSpeech:
    """An utterance from `start` on, cut off (with a short fade) at `until` if that is sooner.

    It is not heard if it is cut off before it starts; then only its lips may have begun to move.
    """

    start: float
    until: float
    utterance: Utterance
    character: int
    gains: tuple[Gain, ...] = ()

    @property
    def is_heard(self) -> bool:
        return self.until > self.start

    def is_complete(self, now: float) -> bool:
        """Whether all of it has been heard."""
        return min(self.until, now) >= self.start + self.utterance.duration - HEARD

    def words(self, now: float) -> list[str]:
        """Return the words that have been heard completely."""
        until = min(self.until, now) - self.start + HEARD
        return [word.text for word in self.utterance.words if word.end <= until]
