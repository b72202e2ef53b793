"""Long work: computations count their steps, to be limited and paused; threads serve their owners in turn."""

import threading
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from operator import length_hint
from typing import Any, ParamSpec, Protocol, TypeVar

from realizer.core.errors import RealizerError

T = TypeVar("T")
P = ParamSpec("P")

TOGETHER = 16  # items of a loop that are counted at once


class WorkLimitError(RealizerError):
    """A computation needs more steps than it may take."""


class Pauser(Protocol):
    """Lets other work go on in the midst of a computation."""

    def pause(self) -> None:
        """Return when the computation may go on; called at every count."""

    def wait_for(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function in another thread, and return its result when others have gone on meanwhile."""


class _Limit:
    """The steps that are left."""

    __slots__ = ("left", "steps")

    def __init__(self, steps: int) -> None:
        self.steps = self.left = steps


_limit: ContextVar[_Limit | None] = ContextVar("limit", default=None)
_pauser: ContextVar[Pauser | None] = ContextVar("pauser", default=None)


def count(steps: int = 1) -> None:
    """Count steps of a computation, about a microsecond each, before they are done.

    Raises:
        WorkLimitError: the computation has no steps left.
    """
    if (limit := _limit.get()) is not None:
        limit.left -= steps
        if limit.left < 0:
            raise WorkLimitError(f"wanted at most {limit.steps} steps of planning, got more")
    if (pauser := _pauser.get()) is not None:
        pauser.pause()


def counted(items: Iterable[T], steps: int = 1) -> Iterator[T]:
    """Return an iterator over items that counts so many steps for each."""
    size = length_hint(items, TOGETHER + 1)
    if size > TOGETHER:
        return _counted(items, steps)
    if size:
        count(steps * size)
    return iter(items)


def _counted(items: Iterable[T], steps: int) -> Iterator[T]:
    for number, item in enumerate(items):
        if number % TOGETHER == 0:
            count(steps * TOGETHER)
        yield item


@contextmanager
def limited(steps: int) -> Iterator[None]:
    """Limit the steps that are counted within."""
    token = _limit.set(_Limit(steps))
    try:
        yield
    finally:
        _limit.reset(token)


def pause_with(pauser: Pauser | None) -> None:
    """Set the pauser of the computations in this context."""
    _pauser.set(pauser)


def call_native(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Call a function that computes for long without Python, so that it cannot count its work.

    It is called in another thread if this context has a pauser: it should release Python's lock.
    """
    pauser = _pauser.get()
    return function(*args, **kwargs) if pauser is None else pauser.wait_for(function, *args, **kwargs)


class FairPool:
    """A pool of threads: of the owners whose calls wait, each has one call made before another's second."""

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
