"""The base of the voices that the registry lists."""

from __future__ import annotations

from abc import ABC, abstractmethod

from realizer.speech.utterance import SpeechRequest, Utterance


class BaseVoice(ABC):
    """Turns text with marks into an utterance. Its methods block, and may be called from any thread.

    Args:
        voice: one of its own voices: what follows the colon in "espeak:nl". None for its default.

    Attributes:
        name: the name in the registry of voices, then a colon and the voice where there is one.
        engine: what speaks, for lists.
        description: one sentence, for lists.
    """

    name: str
    engine: str = ""
    description: str = ""

    def __init__(self, voice: str | None = None) -> None:
        if voice:
            self.name = f"{self.name}:{voice}"

    @classmethod
    def missing(cls, voice: str | None = None) -> str | None:
        """Return the sentence that says what to install or to change; None if the voice works here."""
        return f"voice {cls.name}: wanted nothing after its name, got {voice!r}" if voice else None

    @classmethod
    def languages(cls) -> tuple[str, ...]:
        """Return BCP-47 tags of what it speaks; () if they are not known before its engine starts."""
        return ()

    @abstractmethod
    def say(self, request: SpeechRequest) -> Utterance:
        """Speak.

        Raises:
            VoiceError: the engine is missing or died; the text says what to do. The next call works again.
        """

    def close(self) -> None:  # noqa: B027
        """End the engine's process, if it has one. May be called twice."""
