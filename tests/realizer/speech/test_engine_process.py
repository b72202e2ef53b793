"""The client of an engine's process."""

from __future__ import annotations

import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from realizer.core.errors import VoiceError
from realizer.speech.engine_process import Engine, EngineProcess

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
        process.ask({"op": "sleep"})
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
            process.ask({"op": "sleep"})
        except VoiceError as error:
            errors.append(str(error))

    thread = threading.Thread(target=wait)
    thread.start()
    while process._running is None or process._running._deadline == float("inf"):
        assert thread.is_alive()
    process.close()
    thread.join(10)
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
