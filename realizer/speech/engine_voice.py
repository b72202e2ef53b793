"""Voices whose engine runs in a process of its own, which is replaced if it dies or hangs."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
import weakref
from abc import abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from realizer.core.errors import VoiceError
from realizer.speech.base_voice import BaseVoice
from realizer.speech.ssml import Break, Script, read_script
from realizer.speech.ssml_support import supported
from realizer.speech.utterance import SpeechRequest, Utterance

RUN = Path(__file__).with_name("engine_worker.py")
CHECKS = 20  # number of checks of a running request within its time limit
MOST_CACHED = 64  # utterances
MAX_SAMPLES = 30_000_000  # of cached utterances, about 60 MB


@dataclass(frozen=True, slots=True)
class Engine:
    """An engine that runs in a process of its own."""

    name: str  # its name in messages
    worker: Path  # its file, the first argument of `engine_worker`
    # returns a sentence that says what to install, or None if it is installed
    install_hint: Callable[[], str | None]


class EngineProcess:
    """A process that starts with the first request and serves one at a time; thread-safe.

    Args:
        options: further arguments of the process.
        limit: seconds after which a request is cancelled, and the process replaced.
    """

    def __init__(self, engine: Engine, options: tuple[str, ...] = (), limit: float = 30.0) -> None:
        self._engine = engine
        self._options = options
        self._limit = limit
        self._lock = threading.Lock()
        self._running: _Running | None = None
        self._end: weakref.finalize[..., EngineProcess] | None = None
        self._owner = os.getpid()
        self._hello: dict[str, Any] = {}

    @property
    def pid(self) -> int | None:
        running = self._running
        return None if running is None else running.process.pid

    def hello(self) -> dict[str, Any]:
        """Return the engine's description of itself (rate, voices, variants), starting it if needed.

        Raises:
            VoiceError: the engine is not installed or does not start.
        """
        with self._lock:
            if not self._hello:
                self._started()
            return self._hello

    def ask(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Send a request, and return the head and the body of the answer.

        Raises:
            VoiceError: the engine is not installed, refused the request, ended or took too long; the next
                call starts it again.
        """
        with self._lock:
            running = self._started()
            try:
                with running.waiting():
                    head, body = _exchange(running, request)
            except (OSError, ValueError) as error:
                self._stop()
                raise VoiceError(
                    f"{self._engine.name} ended or did not answer within {self._limit:g} s ({error}); "
                    "the next text starts it again"
                ) from None
            if head["last"]:
                self._stop()
        if "error" in head:
            raise VoiceError(f"{self._engine.name}: {head['error']}")
        return head, body

    def close(self) -> None:
        """End the process, even during a request of another thread. May be called twice."""
        running = self._running
        if running is not None and self._owner == os.getpid():
            running.process.kill()  # a running request then ends with an error and releases the lock
        with self._lock:
            self._stop()

    def _started(self) -> _Running:
        if self._owner != os.getpid():  # after a fork, the process belongs to the parent
            self._running, self._end, self._owner = None, None, os.getpid()
        if self._running is not None:
            if self._running.process.poll() is None:
                return self._running
            self._stop()  # it died between requests
        fix = self._engine.install_hint()
        if fix:
            raise VoiceError(fix)
        process = subprocess.Popen(
            # A path and -P, so that the process imports only modules that the worker needs.
            [sys.executable, "-P", str(RUN), str(self._engine.worker), *self._options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self._running = running = _Running(process, self._limit)
        self._end = weakref.finalize(self, running.end)
        try:
            with running.waiting():
                hello = json.loads(running.outwards.readline())
        except (OSError, ValueError):
            hello = {"error": "it ended while it started"}
        if "error" in hello:
            self._stop()
            raise VoiceError(f"{self._engine.name} does not start: {hello['error']}")
        self._hello = hello
        return running

    def _stop(self) -> None:
        end, self._running, self._end = self._end, None, None
        if end is not None and self._owner == os.getpid():
            end()


class _Running:
    """A process that is killed when a request takes too long.

    One thread watches it as long as it runs, because a thread for each request would take as much time as the
    rest of the request.
    """

    def __init__(self, process: subprocess.Popen[bytes], limit: float) -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self.process, self.inwards, self.outwards = process, process.stdin, process.stdout
        self._limit = limit
        self._deadline = float("inf")  # deadline of the current request
        self._ended = threading.Event()
        threading.Thread(target=self._watch, name="watch", daemon=True).start()

    @contextlib.contextmanager
    def waiting(self) -> Iterator[None]:
        """Limit the time until the end of the block."""
        self._deadline = time.monotonic() + self._limit
        try:
            yield
        finally:
            self._deadline = float("inf")

    def end(self) -> None:
        self._ended.set()
        self.process.kill()
        self.process.wait()
        for pipe in (self.inwards, self.outwards):
            with contextlib.suppress(OSError):  # buffered output has no reader
                pipe.close()

    def _watch(self) -> None:
        while not self._ended.wait(self._limit / CHECKS):
            if time.monotonic() > self._deadline:
                self.process.kill()


def _exchange(running: _Running, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    running.inwards.write(json.dumps(request).encode() + b"\n")
    running.inwards.flush()
    line = running.outwards.readline()
    if not line:
        raise OSError("end of the pipe")
    head: dict[str, Any] = json.loads(line)
    body = running.outwards.read(head["bytes"])
    if len(body) != head["bytes"]:
        raise OSError("half an answer")
    return head, body


class EngineVoice(BaseVoice):
    """A voice whose engine runs in a process of its own; the same request gives the same samples.

    Thread-safe. The process starts with the first request; if it dies, that request fails with VoiceError and
    the next one starts it again. `limit` and `options` are those of `EngineProcess`.
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
        return self._process.pid

    def _speak(self, request: SpeechRequest) -> Utterance:
        script = supported(read_script(request), self.elements, self.engine)
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
            while len(self._utterances) > MOST_CACHED or self._samples() > MAX_SAMPLES:
                del self._utterances[next(iter(self._utterances))]
        return utterance

    def _samples(self) -> int:
        return sum(len(said.pcm) for said in self._utterances.values() if said.pcm is not None)
