"""A cache of recent utterances."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable

from realizer.speech.utterance import Say, Utterance

MOST = 64  # utterances
MOST_SAMPLES = 30_000_000  # about 60 MB


class Kept:
    """The latest utterances by request; callable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._said: OrderedDict[Say, Utterance] = OrderedDict()
        self._samples = 0

    def get(self, request: Say, speak: Callable[[Say], Utterance]) -> Utterance:
        """What was said before, or what `speak` says now, which is then kept."""
        with self._lock:
            if request in self._said:
                self._said.move_to_end(request)
                return self._said[request]
        utterance = speak(request)
        with self._lock:
            if (same := self._said.pop(request, None)) is not None:  # another thread asked too
                self._samples -= _samples(same)
            self._said[request] = utterance
            self._samples += _samples(utterance)
            while self._said and (len(self._said) > MOST or self._samples > MOST_SAMPLES):
                self._samples -= _samples(self._said.popitem(last=False)[1])
        return utterance


def _samples(utterance: Utterance) -> int:
    return 0 if utterance.pcm is None else len(utterance.pcm)
