"""The base of voices whose engine runs in a process of its own."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

from realizer.speech.base_voice import BaseVoice
from realizer.speech.cache import UtteranceCache
from realizer.speech.engine_process import Engine, EngineProcess
from realizer.speech.ssml import Break, Script, read_script
from realizer.speech.utterance import SpeechRequest, Utterance


class EngineVoice(BaseVoice):
    """A voice with an engine of its own; the same request gives the same samples.

    Thread-safe. The process starts with the first request; if it dies, that request fails with VoiceError and
    the next one starts it again.

    Args:
        voice: one of the engine's voices, or None for its default.
        limit: seconds that one request of the engine may take.
        options: for the worker process.
    """

    worker: ClassVar[Engine]

    def __init__(
        self, voice: str | None = None, *, limit: float = 30.0, options: tuple[str, ...] = ()
    ) -> None:
        super().__init__(voice)
        self._voice = voice
        self._process = EngineProcess(self.worker, options, limit)
        self._cache = UtteranceCache()

    def say(self, request: SpeechRequest) -> Utterance:
        """Speak; `duration` is exactly the sound's.

        Wrong SSML is spoken as plain text, control characters and emoji are left out, an unknown language is
        spoken as English, an empty text is no sound: each with a warning.

        Raises:
            VoiceError: the text is too long, or the engine is missing, died or hung.
        """
        return self._cache.get(request, self._speak)

    def close(self) -> None:
        """End the process; may be called twice. A later request starts it again."""
        self._process.close()

    @property
    def pid(self) -> int | None:
        """Id of the engine's process while it runs."""
        return self._process.pid

    def _speak(self, request: SpeechRequest) -> Utterance:
        script = read_script(request)
        if script.is_silent and not any(isinstance(part, Break) for part in script.parts):
            return Utterance(0.0, (), (), dict.fromkeys(script.marks, 0.0), warnings=script.warnings)
        return self._synthesize(request, script)

    @abstractmethod
    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        """Return what the engine makes of a request that has something to say, uncached."""
