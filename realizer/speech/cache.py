"""A cache of recent utterances."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable

from realizer.speech.utterance import SpeechRequest, Utterance

MOST = 64  # utterances
MAX_SAMPLES = 30_000_000  # about 60 MB


class UtteranceCache:
    """The latest utterances by request; thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._utterances: OrderedDict[SpeechRequest, Utterance] = OrderedDict()
        self._samples = 0

    def get(self, request: SpeechRequest, speak: Callable[[SpeechRequest], Utterance]) -> Utterance:
        """Return the cached utterance of a request, or synthesize it with `speak` and cache it."""
        with self._lock:
            if request in self._utterances:
                self._utterances.move_to_end(request)
                return self._utterances[request]
        utterance = speak(request)
        with self._lock:
            if (same := self._utterances.pop(request, None)) is not None:  # from another thread
                self._samples -= _samples(same)
            self._utterances[request] = utterance
            self._samples += _samples(utterance)
            while self._utterances and (len(self._utterances) > MOST or self._samples > MAX_SAMPLES):
                self._samples -= _samples(self._utterances.popitem(last=False)[1])
        return utterance


def _samples(utterance: Utterance) -> int:
    return 0 if utterance.pcm is None else len(utterance.pcm)
