"""Voices with an engine: what happens before the engine is used."""

import gc
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import VoiceError
from realizer.speech import engine_voice
from realizer.speech.engine_voice import MOST_CACHED, Engine, EngineProcess, EngineVoice, UtteranceCache
from realizer.speech.ssml import Script
from realizer.speech.utterance import SpeechRequest, Utterance
from tests.waiting import LIMIT


class Counting(EngineVoice):
    name = "counting"
    worker = Engine("counting", Path("none.py"), lambda: None)
    asked = 0

    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        self.asked += 1
        return Utterance(1.0, (), (), {})


def test_engine_voice_speaks_the_same_request_once() -> None:
    voice = Counting()
    assert voice.say(SpeechRequest("Hello")) is voice.say(SpeechRequest("Hello"))
    voice.say(SpeechRequest("Bye"))
    assert voice.asked == 2


def test_engine_voice_says_nothing_without_its_engine() -> None:
    voice = Counting()
    said = voice.say(SpeechRequest('<mark name="m"/> ', marks=("m",)))
    assert (said.duration, said.marks, voice.asked, voice.pid) == (0.0, {"m": 0.0}, 0, None)
    assert said.warnings


def test_engine_voice_asks_for_a_break() -> None:
    voice = Counting()
    voice.say(SpeechRequest('<break time="1s"/>'))
    assert voice.asked == 1


def test_engine_voice_can_be_closed_twice() -> None:
    voice = Counting("low")
    assert voice.name == "counting:low"
    voice.close()
    voice.close()


class Speaker:
    """Synthesizes a sound of some samples and counts requests."""

    def __init__(self, samples: int | None = None) -> None:
        self.samples = samples
        self.requests: list[str] = []

    def __call__(self, request: SpeechRequest) -> Utterance:
        self.requests.append(request.ssml)
        pcm = None if self.samples is None else np.zeros(self.samples, np.int16)
        return Utterance(1.0, (), (), {}, 8000, pcm)


def test_cache_returns_an_equal_request_without_synthesis() -> None:
    utterances, speaker = UtteranceCache(), Speaker()
    first = utterances.get(SpeechRequest("a"), speaker)
    assert utterances.get(SpeechRequest("a"), speaker) is first
    assert utterances.get(SpeechRequest("a", rate=2.0), speaker) is not first
    assert speaker.requests == ["a", "a"]


def test_cache_drops_the_utterance_that_was_not_used_for_longest() -> None:
    utterances, speaker = UtteranceCache(), Speaker()
    for k in range(MOST_CACHED):
        utterances.get(SpeechRequest(str(k)), speaker)
    utterances.get(SpeechRequest("0"), speaker)  # now 1 is the oldest
    utterances.get(SpeechRequest("new"), speaker)
    del speaker.requests[:]
    for text in ("0", "2", "new", "1"):
        utterances.get(SpeechRequest(text), speaker)
    assert speaker.requests == ["1"]


def test_cache_limits_the_sum_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_voice, "MAX_SAMPLES", 1000)
    utterances, speaker = UtteranceCache(), Speaker(400)
    for text in "abcb":
        utterances.get(SpeechRequest(text), speaker)
    assert speaker.requests == ["a", "b", "c"]
    utterances.get(SpeechRequest("a"), speaker)
    assert speaker.requests[3:] == ["a"]
    huge = Speaker(2000)
    for _ in range(2):
        utterances.get(SpeechRequest("huge"), huge)
    assert len(huge.requests) == 2


def test_cache_keeps_the_later_of_two_simultaneous_utterances() -> None:
    utterances, inner, outer = UtteranceCache(), Speaker(10), Speaker(10)
    request = SpeechRequest("a")

    def slow(request: SpeechRequest) -> Utterance:
        utterances.get(request, inner)  # as from another thread, meanwhile
        return outer(request)

    last = utterances.get(request, slow)
    assert utterances.get(request, inner) is last
    assert (len(inner.requests), len(outer.requests)) == (1, 1)


Start = Callable[..., EngineProcess]

FAKE = Engine("fake", Path(__file__).with_name("engines.py"), lambda: None)


@pytest.fixture
def start() -> Iterator[Start]:
    running: list[EngineProcess] = []

    def start(*options: str, limit: float = 30.0, engine: Engine = FAKE) -> EngineProcess:
        running.append(EngineProcess(engine, options, limit))
        return running[-1]

    yield start
    for process in running:
        process.close()


def ask(process: EngineProcess, text: str = "hello") -> tuple[int, bytes]:
    head, body = process.ask({"op": "echo", "text": text})
    return head["count"], body


def assert_gone(pid: int | None) -> None:
    assert pid is not None
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_engine_process_starts_with_the_first_request(start: Start) -> None:
    process = start()
    assert process.pid is None
    assert process.hello()["rate"] == 8000
    pid = process.pid
    assert [ask(process), ask(process, "")] == [(1, b"hello"), (2, b"")]
    assert process.pid == pid


def test_engine_process_raises_errors_of_the_engine_and_goes_on(start: Start) -> None:
    process = start()
    with pytest.raises(VoiceError, match="fake: it cannot"):
        process.ask({"op": "fail"})
    assert ask(process) == (1, b"hello")


def test_engine_process_starts_again_after_a_crash(start: Start) -> None:
    process = start()
    with pytest.raises(VoiceError, match=r"fake ended or did not answer .* starts it again"):
        process.ask({"op": "die"})
    assert process.pid is None
    assert ask(process) == (1, b"hello")


def test_engine_process_starts_again_if_it_died_between_requests(start: Start) -> None:
    process = start()
    ask(process)
    assert process._running is not None
    process._running.process.kill()
    process._running.process.wait()
    assert ask(process) == (1, b"hello")


def test_engine_process_replaces_a_process_that_hangs(start: Start) -> None:
    process = start(limit=5.0)
    ask(process)
    process._limit = 0.2
    pid = process.pid
    with pytest.raises(VoiceError, match=r"did not answer within 0\.2 s"):
        process.ask({"op": "hang"})
    assert_gone(pid)
    process._limit = 5.0
    assert ask(process) == (1, b"hello")


def test_engine_process_serves_many_threads(start: Start) -> None:
    process = start()
    answers: list[bytes] = []

    def speak(thread: int) -> None:
        answers.extend(ask(process, f"{thread} {k}")[1] for k in range(8))

    threads = [threading.Thread(target=speak, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(answers) == sorted(f"{n} {k}".encode() for n in range(4) for k in range(8))


def test_engine_process_can_be_closed_during_a_request(start: Start) -> None:
    process = start()
    process.hello()
    errors: list[str] = []

    def wait() -> None:
        try:
            process.ask({"op": "hang"})
        except VoiceError as error:
            errors.append(str(error))

    thread = threading.Thread(target=wait)
    thread.start()
    while process._running is None or process._running._deadline == float("inf"):
        assert thread.is_alive()
    process.close()
    thread.join(LIMIT)
    assert errors
    process.close()
    assert ask(process) == (1, b"hello")


@pytest.mark.parametrize("close", [True, False])
def test_engine_process_leaves_no_process(close: bool) -> None:
    process = EngineProcess(FAKE)
    ask(process)
    pid = process.pid
    if close:
        process.close()
        assert process.pid is None
    del process
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # of sockets that other tests left
        gc.collect()
    assert_gone(pid)


def test_engine_process_names_a_fault_at_its_start(start: Start) -> None:
    with pytest.raises(VoiceError, match="fake does not start: it has no data"):
        start("broken").hello()
    absent = Engine("fake", Path("nowhere.py"), lambda: None)
    with pytest.raises(VoiceError, match="fake does not start"):
        start(engine=absent).hello()
    not_installed = Engine("fake", FAKE.worker, lambda: "install it")
    with pytest.raises(VoiceError, match="install it"):
        ask(start(engine=not_installed))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_engine_process_of_a_parent_is_not_used_after_a_fork(start: Start) -> None:
    process = start()
    ask(process)
    pid = process.pid
    child = os.fork()
    if child == 0:
        fresh = False
        try:
            fresh = ask(process) == (1, b"hello") and process.pid != pid
            process.close()
        finally:
            os._exit(0 if fresh else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert ask(process) == (2, b"hello")


def test_engine_process_survives_an_interrupt(start: Start) -> None:
    process = start()
    ask(process)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGINT)  # Ctrl-C in a terminal reaches all processes
    assert ask(process) == (2, b"hello")
