"""Time that waits for nobody: the clock of an event loop jumps to what is due, and threads answer at once.

So what depends on time is the same on every machine, however busy, and takes no longer than the work it is.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

import pytest

from benchmarks.virtual_clock import VirtualLoop

__all__ = ["run"]

T = TypeVar("T")


def run(main: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine; bytes between sockets of this process arrive before the clock jumps."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ThreadPoolExecutor, "submit", _called_at_once)
        with asyncio.Runner(loop_factory=VirtualLoop) as runner:
            return runner.run(main)


def _called_at_once(pool: object, function: Any, *arguments: Any, **named: Any) -> Future[Any]:
    """Call a function instead of giving it to a thread, of which the clock knows nothing."""
    done = Future[Any]()
    try:
        done.set_result(function(*arguments, **named))
    except Exception as error:
        done.set_exception(error)
    return done
