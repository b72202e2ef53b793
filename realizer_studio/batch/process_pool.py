"""Execution of tasks by local processes, which are replaced when they die.

`concurrent.futures` does not fit: one dead process breaks its whole pool, and a task cannot be ended.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from realizer.core.threads import SINGLE_THREAD
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Outcome, Worker, failure

TRIES = 3  # a task whose process has died so often fails


class ProcessPool:
    """A pool of spawned worker processes, which run one task at a time.

    Args:
        options: how documents are played.
        count: how many workers.
    """

    def __init__(self, options: Options, count: int) -> None:
        self.options = options
        self.count = count
        self._workers: list[_WorkerProcess] = []

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """Yield the outcome of each task as it arrives. A task whose process dies is repeated."""
        source = ((task, 1) for task in tasks)
        retries: deque[tuple[Task, int]] = deque()

        def next_work() -> tuple[Task, int] | None:
            return retries.popleft() if retries else next(source, None)

        try:
            while len(self._workers) < self.count and (work := next_work()) is not None:
                self._workers.append(_WorkerProcess(self.options))
                self._workers[-1].send(work)
            while busy := {worker.pipe: worker for worker in self._workers if worker.work is not None}:
                for pipe in wait(list(busy)):
                    worker = busy[pipe]  # type: ignore[index]
                    assert worker.work is not None
                    task, tries = worker.work
                    outcome = worker.receive()
                    if outcome is None:
                        code = worker.end()
                        self._workers[self._workers.index(worker)] = worker = _WorkerProcess(self.options)
                        if tries < TRIES:
                            retries.append((task, tries + 1))
                        else:
                            words = f"its process ended {TRIES} times (exit status {code})"
                            outcome = failure(task, words)
                    if (work := next_work()) is not None:
                        worker.send(work)
                    if outcome is not None:
                        yield outcome
        finally:
            self.close()

    def close(self) -> None:
        """End the processes, also in the middle of a task."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()


class _WorkerProcess:
    """A worker process.

    Attributes:
        work: its task, and how often that has been tried; None while it is idle.
    """

    def __init__(self, options: Options) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_serve, args=(theirs, options), daemon=True)
        added = [name for name in SINGLE_THREAD if name not in os.environ]
        os.environ.update(dict.fromkeys(added, "1"))
        try:
            with _signals_held():  # one in between would leave a process that knows half of what it needs
                self._process.start()
        finally:
            for name in added:
                del os.environ[name]
        theirs.close()
        self.work: tuple[Task, int] | None = None

    def send(self, work: tuple[Task, int]) -> None:
        self.work = work
        with contextlib.suppress(OSError):  # it has died: `receive` returns None
            self.pipe.send(work[0])

    def receive(self) -> Outcome | None:
        """Return the outcome of the task, or None if the process has died."""
        self.work = None
        try:
            outcome: Outcome = self.pipe.recv()
        except (EOFError, OSError):
            return None
        return outcome

    def end(self) -> int | None:
        """End the process, kill it if that takes too long, and return its exit status."""
        self.pipe.close()
        self._process.join(0 if self.work is not None else 2)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        return self._process.exitcode


@contextlib.contextmanager
def _signals_held() -> Iterator[None]:
    """Hold SIGINT and SIGTERM until the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread has handlers
        return
    came: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, lambda number, _: came.append(number)) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for held in came:
            signal.raise_signal(held)


def _serve(pipe: Connection[Any, Any], options: Options) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    worker = Worker(options)
    try:
        while True:
            pipe.send(worker.perform(pipe.recv()))
    except (EOFError, OSError):
        pass
    finally:
        worker.close()
