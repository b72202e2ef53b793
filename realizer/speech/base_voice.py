"""The base class of voices."""

from abc import ABC, abstractmethod

from realizer.speech.utterance import SpeechRequest, Utterance


class BaseVoice(ABC):
    """A speech synthesizer. Its methods block, and may be called from any thread.

    Args:
        voice: a voice of its engine: the part after the colon in "espeak:nl". None for the default.
    """

    name: str  # the name in the registry of voices, followed by a colon and the voice, if any
    engine: str = ""  # the name of the engine, for lists
    description: str = ""  # one sentence, for lists
    # the elements of SSML that it changes its way of speaking for, of `ssml.SPOKEN`
    elements: frozenset[str] = frozenset({"prosody", "sub"})

    def __init__(self, voice: str | None = None) -> None:
        if voice:
            self.name = f"{self.name}:{voice}"

    @classmethod
    def missing(cls, voice: str | None = None) -> str | None:
        """Return a sentence that says what to install or to change, or None if the voice works here."""
        return f"voice {cls.name}: wanted nothing after its name, got {voice!r}" if voice else None

    @classmethod
    def languages(cls) -> tuple[str, ...]:
        """Return BCP-47 tags of the languages; () if they are unknown before the engine starts."""
        return ()

    @abstractmethod
    def say(self, request: SpeechRequest) -> Utterance:
        """Synthesize speech.

        Raises:
            VoiceError: if the engine is missing or died; the text says what to do. The next call restarts it.
        """

    def close(self) -> None:  # noqa: B027
        """End the engine's process, if it has one. May be called twice."""
