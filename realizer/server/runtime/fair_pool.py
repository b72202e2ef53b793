"""A pool of threads that serves its users in turn."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any


class FairPool:
    """A pool of threads: of the owners whose calls wait, each has one call made before another's second.

    Args:
        threads: number of calls that are made at once.
        name: prefix of the names of the threads.
    """

    def __init__(self, threads: int, name: str) -> None:
        self._pool = ThreadPoolExecutor(threads, name)
        self._waiting: dict[Hashable, deque[tuple[Future[Any], Callable[[], Any]]]] = {}  # in their turns
        self._lock = threading.Lock()

    def submit(self, owner: Hashable, function: Callable[[], Any]) -> Future[Any]:
        """Call a function in a thread when it is its owner's turn."""
        future: Future[Any] = Future()
        with self._lock:
            self._waiting.setdefault(owner, deque()).append((future, function))
        self._pool.submit(self._make_next)
        return future

    def drop(self, owner: Hashable) -> None:
        """Cancel the calls of an owner that have not begun."""
        with self._lock:
            dropped = self._waiting.pop(owner, ())
        for future, _ in dropped:
            future.cancel()

    def close(self) -> None:
        """Cancel the calls that have not begun; those that have go on."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _make_next(self) -> None:
        with self._lock:
            if not self._waiting:
                return  # calls were dropped
            owner = next(iter(self._waiting))
            calls = self._waiting.pop(owner)
            future, function = calls.popleft()
            if calls:
                self._waiting[owner] = calls
        if future.set_running_or_notify_cancel():
            try:
                result = function()
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)
