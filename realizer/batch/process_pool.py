"""Execution of tasks by local processes, which are replaced when they die."""

from __future__ import annotations

import contextlib
import os
import signal
from collections import deque
from collections.abc import Iterable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from realizer.batch.task import Options, Task
from realizer.batch.worker import Outcome, Worker, failure

TRIES = 3  # a document that ends its process so often is the reason for it
# A process a core is the rule: libraries that start threads of their own would only be in each other's way.
ALONE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class ProcessPool:
    """Workers that are started fresh (spawned, not forked), one task at a time each.

    Args:
        options: how documents are played.
        count: how many workers.
    """

    def __init__(self, options: Options, count: int) -> None:
        self.options = options
        self.count = count
        self._workers: list[_WorkerProcess] = []

    @property
    def pids(self) -> tuple[int, ...]:
        """The processes that are there."""
        return tuple(member.pid for member in self._workers)

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """The outcome of each task, as they come. A task whose process dies is given to another one."""
        source = iter(tasks)
        again: deque[tuple[Task, int]] = deque()

        def following() -> tuple[Task, int] | None:
            if again:
                return again.popleft()
            task = next(source, None)
            return None if task is None else (task, 1)

        try:
            while len(self._workers) < self.count and (work := following()) is not None:
                self._workers.append(_WorkerProcess(self.options))
                self._workers[-1].send(*work)
            while busy := {member.pipe: member for member in self._workers if member.work is not None}:
                for pipe in wait(list(busy)):
                    member = busy[pipe]  # type: ignore[index]
                    task, tried = member.take_back()
                    outcome = member.answer()
                    if outcome is None:
                        code = member.end()
                        self._workers[self._workers.index(member)] = member = _WorkerProcess(self.options)
                        if tried < TRIES:
                            again.append((task, tried + 1))
                        else:
                            words = f"its process ended {TRIES} times (exit status {code})"
                            outcome = failure(task, words)
                    if (work := following()) is not None:
                        member.send(*work)
                    if outcome is not None:
                        yield outcome
        finally:
            self.close()

    def close(self) -> None:
        """End the workers, also in the middle of a task."""
        for member in self._workers:
            member.end()
        self._workers.clear()


class _WorkerProcess:
    """One worker process and what it is at."""

    def __init__(self, options: Options) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_serve, args=(theirs, options), daemon=True)
        before = {name: os.environ.get(name) for name in ALONE}
        os.environ.update({name: value or "1" for name, value in before.items()})
        try:
            self._process.start()
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
        theirs.close()
        self.work: tuple[Task, int] | None = None

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    def send(self, task: Task, tried: int) -> None:
        self.work = task, tried
        with contextlib.suppress(OSError):  # it is dead; its answer says so
            self.pipe.send(task)

    def take_back(self) -> tuple[Task, int]:
        assert self.work is not None
        work, self.work = self.work, None
        return work

    def answer(self) -> Outcome | None:
        """None where it died."""
        try:
            outcome: Outcome = self.pipe.recv()
        except (EOFError, OSError):
            return None
        return outcome

    def end(self) -> int | None:
        """Its exit status: it is told to go, and made to where it does not."""
        self.pipe.close()
        self._process.join(0 if self.work is not None else 2)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        return self._process.exitcode


def _serve(pipe: Connection[Any, Any], options: Options) -> None:
    """What a worker does until nobody is at the other end any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asked
    worker = Worker(options)
    try:
        while True:
            pipe.send(worker.perform(pipe.recv()))
    except (EOFError, OSError):
        pass
    finally:
        worker.close()
