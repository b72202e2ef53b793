"""Execution of tasks on a Dask cluster."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from realizer.batch.task import Options, Task
from realizer.batch.worker import Outcome, failure, perform
from realizer.core.errors import RealizerError

log = logging.getLogger(__name__)

AHEAD = 4  # tasks a worker has waiting, so that it never waits for us; their outcomes must fit in memory
PATIENCE = 20.0  # s to find the scheduler


class DaskCluster:
    """The workers of a scheduler; they need the same realizer, face and files at the same places.

    A task whose worker dies is given to another one by the scheduler itself.

    Args:
        options: how documents are played.
        address: of the scheduler, such as tcp://10.0.0.1:8786.

    Raises:
        RealizerError: Dask is not installed, or no scheduler answers there.
    """

    def __init__(self, options: Options, address: str) -> None:
        try:
            import distributed
        except ImportError:
            raise RealizerError(
                "--dask needs Dask distributed: pip install 'bml-realizer[cluster]'"
            ) from None
        self.options = options
        self._address = address
        try:
            # Its functions have no types.
            self._dask: Any = distributed
            self._client = self._dask.Client(address, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            raise RealizerError(f"--dask {address}: wanted a Dask scheduler there: {error}") from None

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """The outcome of each task, as they come.

        Raises:
            RealizerError: the scheduler is gone.
        """
        source = iter(tasks)
        waiting: dict[Any, Task] = {}

        def submit(task: Task) -> Any:
            key = f"realizer-{task.key}-{task.name}"
            future = self._client.submit(perform, self.options, task, key=key, pure=False)
            waiting[future] = task
            return future

        threads = sum(self._client.nthreads().values())
        if not threads:
            log.warning("--dask %s: it has no worker yet, one is waited for", self._address)
        completed = self._dask.as_completed(
            [submit(task) for task in islice(source, AHEAD * max(1, threads))]
        )
        for future in completed:
            task = waiting.pop(future)
            if future.cancelled():  # nobody else does that
                raise RealizerError(
                    f"--dask {self._address}: the scheduler went away; the same command plays what is left, "
                    "where one is there again"
                )
            error = future.exception()
            outcome = future.result() if error is None else failure(task, f"{type(error).__name__}: {error}")
            future.release()
            if (following := next(source, None)) is not None:
                completed.add(submit(following))
            yield outcome

    def close(self) -> None:
        """Leave the scheduler; what still waits there is cancelled."""
        self._client.close()
