"""Execution of tasks on a Dask cluster."""

import logging
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from realizer.core.errors import RealizerError
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Outcome, failure, perform

log = logging.getLogger(__name__)

AHEAD = 4  # queued tasks a thread, so that no worker is idle; their outcomes must fit in memory
PATIENCE = 20.0  # s to connect to the scheduler


class DaskCluster:
    """The workers of a Dask scheduler, which need the same realizer, face and files in the same places.

    The scheduler gives a task whose worker dies to another one.

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
            self._dask: Any = distributed  # which is not typed
            self._client = self._dask.Client(address, timeout=PATIENCE)
        except (OSError, ValueError) as error:
            raise RealizerError(f"--dask {address}: wanted a Dask scheduler there: {error}") from None

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """Yield the outcome of each task as it arrives.

        Raises:
            RealizerError: the scheduler is gone.
        """
        source = iter(tasks)
        waiting: dict[Any, Task] = {}

        def submit(task: Task) -> Any:
            key = f"realizer-{task.key}-{task.name}"
            future = self._client.submit(perform, self.options, task, key=key)
            waiting[future] = task
            return future

        threads = sum(self._client.nthreads().values())
        if not threads:
            log.warning("--dask %s: waiting for a worker, it has none yet", self._address)
        completed = self._dask.as_completed(
            [submit(task) for task in islice(source, AHEAD * max(1, threads))]
        )
        for future in completed:
            task = waiting.pop(future)
            if future.cancelled():  # only by the loss of the scheduler
                raise RealizerError(
                    f"--dask {self._address}: the scheduler is gone; the same command plays what is left, "
                    "once there is one again"
                )
            error = future.exception()
            outcome = future.result() if error is None else failure(task, f"{type(error).__name__}: {error}")
            future.release()
            if (following := next(source, None)) is not None:
                completed.add(submit(following))
            yield outcome

    def close(self) -> None:
        """Disconnect from the scheduler, which cancels what is queued."""
        self._client.close()
