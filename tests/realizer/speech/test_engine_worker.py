"""The process around an engine."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from realizer.speech.engine_voice import RUN
from tests.waiting import LIMIT

FAKE = Path(__file__).with_name("engines.py")


def run(*arguments: str, requests: list[dict[str, Any]] | None = None) -> tuple[dict[str, Any], list[Any]]:
    """Return the first line and the answers (head, body) of a worker."""
    text = "".join(json.dumps(request) + "\n" for request in requests or [])
    done = subprocess.run(
        [sys.executable, "-P", str(RUN), *arguments],
        input=text.encode(),
        stdout=subprocess.PIPE,
        timeout=LIMIT,
    )
    hello, _, rest = done.stdout.partition(b"\n")
    answers = []
    while rest:
        line, _, rest = rest.partition(b"\n")
        head = json.loads(line)
        answers.append((head, rest[: head["bytes"]]))
        rest = rest[head["bytes"] :]
    return json.loads(hello), answers


def echo(text: str) -> dict[str, Any]:
    return {"op": "echo", "text": text}


def test_worker_answers_requests_until_its_input_ends() -> None:
    hello, answers = run(str(FAKE), requests=[echo("one"), {"op": "fail"}, echo("")])
    assert hello == {"rate": 8000, "chatty": False}
    assert answers == [
        ({"bytes": 3, "count": 1, "last": False}, b"one"),
        ({"bytes": 0, "error": "it cannot", "last": False}, b""),
        ({"bytes": 0, "count": 2, "last": False}, b""),
    ]


def test_worker_keeps_prints_of_libraries_out_of_its_answers() -> None:
    _, answers = run(str(FAKE), "chatty", requests=[echo("one")])
    assert answers == [({"bytes": 3, "count": 1, "last": False}, b"one")]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_worker_serves_a_drifting_engine_in_forks() -> None:
    _, answers = run(str(FAKE), "drifts", requests=[echo("one"), {"op": "die"}, echo("two")])
    assert [head.get("count") for head, _ in answers] == [1, None, 1]
    assert answers[1][0]["error"].startswith("it crashed")
    assert not any(head["last"] for head, _ in answers)


def test_worker_of_a_drifting_engine_ends_after_a_request_without_fork() -> None:
    _, answers = run(str(FAKE), "drifts", "--no-fork", requests=[echo("one"), echo("two")])
    assert answers == [({"bytes": 3, "count": 1, "last": True}, b"one")]


def test_worker_reports_an_engine_that_does_not_load() -> None:
    assert run(str(FAKE), "broken") == ({"error": "it has no data"}, [])
    assert "nowhere.py" in run("nowhere.py")[0]["error"]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux ends children with their parent")
def test_worker_ends_its_fork_when_it_is_killed(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    command = [sys.executable, "-P", str(RUN), str(FAKE), "drifts"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as worker:
        assert worker.stdin is not None
        worker.stdin.write(json.dumps({"op": "wait", "pipe": str(pipe)}).encode() + b"\n")
        worker.stdin.flush()
        with pipe.open() as open_in_fork:
            fork = int(open_in_fork.readline())
            worker.kill()
            try:
                assert open_in_fork.read() == ""  # the end of the file: the fork has ended
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(fork, signal.SIGKILL)
