"""Local workers: all outcomes, although processes die."""

import os
import signal
from dataclasses import dataclass
from typing import Any

import pytest

from realizer_studio.batch import process_pool
from realizer_studio.batch.process_pool import TRIES, ProcessPool
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Outcome, Worker


def by_name(outcomes: list[Outcome]) -> dict[str, Outcome]:
    named = {outcome.row["document"]: outcome for outcome in outcomes}
    assert len(named) == len(outcomes)
    return named


def pids(crew: ProcessPool) -> list[int]:
    """The ids of the running processes."""
    return [worker._process.pid or 0 for worker in crew._workers]


@pytest.fixture
def expected(tasks: list[Task], options: Options) -> dict[str, Outcome]:
    worker = Worker(options)
    return by_name([worker.perform(task) for task in tasks])


def test_process_pool_gives_the_outputs_of_one_worker(
    tasks: list[Task], options: Options, expected: dict[str, Outcome]
) -> None:
    crew = ProcessPool(options, 2)
    assert by_name(list(crew.perform(tasks))) == expected
    assert pids(crew) == []


@pytest.mark.slow
def test_process_pool_loses_nothing_when_a_worker_is_killed(
    tasks: list[Task], options: Options, expected: dict[str, Outcome]
) -> None:
    crew = ProcessPool(options, 1)
    outcomes = crew.perform(tasks)
    got = [next(outcomes)]
    (at_work,) = pids(crew)  # it was given its second document before the first outcome came out
    os.kill(at_work, signal.SIGKILL)
    got += outcomes
    assert by_name(got) == expected


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadly(Options):
    """Options that end the process they come to."""

    def __reduce__(self) -> Any:
        return os._exit, (3,)


@pytest.mark.slow
def test_process_pool_gives_up_a_document_whose_workers_always_die(
    tasks: list[Task], options: Options, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[Options] = []

    class Counted(process_pool._WorkerProcess):
        def __init__(self, options: Options) -> None:
            started.append(options)
            super().__init__(options)

    monkeypatch.setattr(process_pool, "_WorkerProcess", Counted)
    deadly = Deadly(formats=options.formats, voice=options.voice)
    outcomes = list(ProcessPool(deadly, 1).perform(tasks[:1]))
    assert len(started) == TRIES + 1  # the last one for other documents
    for outcome in outcomes:
        assert outcome.row["status"] == "failed"
        assert outcome.row["error"] == f"its process ended {TRIES} times (exit status 3)"


def test_process_pool_workers_end_with_their_parent(tasks: list[Task], options: Options) -> None:
    crew = ProcessPool(options, 2)
    outcomes = crew.perform(tasks)
    next(outcomes)
    workers = pids(crew)
    outcomes.close()
    for pid in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
