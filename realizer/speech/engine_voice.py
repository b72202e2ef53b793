"""The base class of voices whose engine runs in a process of its own, and a cache of their utterances."""

import threading
from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar

from realizer.speech.base_voice import BaseVoice
from realizer.speech.engine_process import Engine, EngineProcess
from realizer.speech.ssml import Break, Script, read_script
from realizer.speech.utterance import SpeechRequest, Utterance

MOST = 64  # utterances
MAX_SAMPLES = 30_000_000  # about 60 MB


class EngineVoice(BaseVoice):
    """A voice whose engine runs in a process of its own; the same request gives the same samples.

    Thread-safe. The process starts with the first request; if it dies, that request fails with VoiceError and
    the next one starts it again.

    Args:
        voice: one of the engine's voices, or None for its default.
        limit: greatest duration of one request to the engine, in seconds.
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
        """Synthesize speech; `duration` is exactly that of the sound.

        Malformed SSML is spoken as plain text, control characters and emoji are ignored, an unknown language
        is spoken as English, an empty text has no sound; each gives a warning.

        Raises:
            VoiceError: if the text is too long, or the engine is missing, died or hung.
        """
        return self._cache.get(request, self._speak)

    def close(self) -> None:
        """End the process. May be called twice; a later request starts it again."""
        self._process.close()

    @property
    def pid(self) -> int | None:
        """The id of the engine's process, or None if it is not running."""
        return self._process.pid

    def _speak(self, request: SpeechRequest) -> Utterance:
        script = read_script(request)
        if script.is_silent and not any(isinstance(part, Break) for part in script.parts):
            return Utterance(0.0, (), (), dict.fromkeys(script.marks, 0.0), warnings=script.warnings)
        return self._synthesize(request, script)

    @abstractmethod
    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        """Return the engine's utterance of a script that is not empty."""


class UtteranceCache:
    """The latest utterances by request, the oldest first; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._utterances: dict[SpeechRequest, Utterance] = {}

    def get(self, request: SpeechRequest, speak: Callable[[SpeechRequest], Utterance]) -> Utterance:
        """Return the cached utterance of a request, or synthesize it with `speak` and cache it."""
        with self._lock:
            if request in self._utterances:
                self._utterances[request] = utterance = self._utterances.pop(request)
                return utterance
        utterance = speak(request)
        with self._lock:
            self._utterances.pop(request, None)  # from another thread
            self._utterances[request] = utterance
            while len(self._utterances) > MOST or self._samples() > MAX_SAMPLES:
                del self._utterances[next(iter(self._utterances))]
        return utterance

    def _samples(self) -> int:
        return sum(len(said.pcm) for said in self._utterances.values() if said.pcm is not None)
