"""Runs a service in an event loop with a virtual clock, so that every run is the same.

Used by `compare_checkouts.py` and `house.py`. Only public names of `realizer` are used.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import re
import selectors
import signal
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import realizer

__all__ = ["VirtualLoop", "run", "service"]

START = 1000.0  # s on the loop's clock
EPOCH = 1_700_000_000.0  # result of `time.time`, which feedback contains
GRACE = 0.002  # s of real time in which bytes arrive on the loopback device


class _Selector(selectors.DefaultSelector):
    """A selector that moves the clock to the next timer instead of waiting for it."""

    loop: VirtualLoop

    def select(self, timeout: float | None = None) -> list[Any]:
        ready = super().select(0)
        if ready or (timeout is not None and timeout <= 0):
            return ready
        ready = super().select(None if timeout is None else GRACE)
        if not ready:
            self.loop.skip()
        return ready


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop with a virtual clock; `run_in_executor` calls functions immediately, in this thread."""

    def __init__(self) -> None:
        selector = _Selector()
        selector.loop = self
        self._now = START
        super().__init__(selector)

    def time(self) -> float:
        """Return the seconds of the virtual clock."""
        return self._now

    def skip(self) -> None:
        """Move the clock to the next timer."""
        self._now = max(self._now, self._scheduled[0]._when)  # type: ignore[attr-defined]

    def run_in_executor(self, executor: Any, func: Callable[..., Any], *args: Any) -> asyncio.Future[Any]:
        """Call `func` immediately, so that results come in the order of the calls."""
        future = self.create_future()
        try:
            future.set_result(func(*args))
        except Exception as error:
            future.set_exception(error)
        return future


def _submit(pool: ThreadPoolExecutor, function: Callable[..., Any], *args: Any, **named: Any) -> Future[Any]:
    future = Future[Any]()
    try:
        future.set_result(function(*args, **named))
    except Exception as error:
        future.set_exception(error)
    return future


def run(main: Any) -> Any:
    """Run a coroutine in a virtual loop; pools of threads call functions immediately too."""
    time.time = lambda: EPOCH
    ThreadPoolExecutor.submit = _submit  # type: ignore[method-assign]
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        return runner.run(main)


@contextlib.asynccontextmanager
async def service(**settings: Any) -> AsyncIterator[str]:
    """Start `realizer.serve` on a free port, yield the URL of its WebSocket, and end it by SIGTERM."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        task = asyncio.create_task(realizer.serve(realizer.Settings(port=0, **settings)))
        while not (found := re.search(r"ws://\S+/ws", printed.getvalue())):
            if task.done():
                task.result()
            await asyncio.sleep(0.01)
    try:
        yield found[0]
    finally:
        os.kill(os.getpid(), signal.SIGTERM)
        await task
