"""Counted work: long computations count their steps, so that they can be limited, and paused for others."""

from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, Protocol, TypeVar

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
    if isinstance(items, Sized) and len(items) <= TOGETHER:
        if items:
            count(steps * len(items))
        return iter(items)
    return _counted(items, steps)


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
