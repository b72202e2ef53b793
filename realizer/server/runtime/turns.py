"""The turns of sessions in the event loop: when they are woken, and when they read documents."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")

# Wake-up times are rounded up to whole steps of uvloop's clock, except those so little after a step. A timer
# of uvloop costs more than many frames: the sessions of a step share one.
STEP = 0.001  # s
SLACK = 5e-4  # of a step
TURN = 0.004  # s; so long sessions are woken before the loop looks for messages again
# Of the time since documents were last read, so much goes to documents before frames come again. When more is
# due than can be done, frames are late and documents are still read; an overloaded process reads no more than
# this share of the time.
READING_SHARE = 0.25
LONGEST_READING = 0.02  # s


class WakeUps(Generic[T]):
    """The times at which sessions are woken, each at most once.

    Args:
        loop: the event loop.
        wake: called with a session and the time at which it was to be woken.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, wake: Callable[[T, float], None]) -> None:
        self._loop = loop
        self._wake = wake
        self._times: dict[T, tuple[float, int]] = {}  # and the steps they are rounded up to
        self._steps: dict[int, dict[T, None]] = {}  # the sessions of a step, which share a timer
        self._due: deque[tuple[int, T]] = deque()  # those whose step has come, to be woken in turn
        self._closed = False

    def set(self, session: T, when: float) -> None:
        """Wake a session at a time, instead of the one before; infinite: never.

        A session that is already due stays so, or one that gets messages all the time would never be woken.
        """
        now = self._loop.time()
        when = max(when, now)
        if (known := self._times.get(session)) is not None:
            old, step = known
            if when < math.inf and (old == when or old <= now):
                return
            del self._times[session]
            self._steps.get(step, {}).pop(session, None)
        if when < math.inf and not self._closed:
            step = math.ceil(when / STEP - SLACK)
            self._times[session] = when, step
            if step not in self._steps:
                self._steps[step] = {}
                self._loop.call_at(step * STEP, self._wake_step, step)
            self._steps[step][session] = None

    @property
    def is_behind(self) -> bool:
        """Whether sessions are due that have not been woken."""
        return bool(self._due)

    def close(self) -> None:
        """Wake no session any more."""
        self._closed = True
        self._times.clear()

    def _wake_step(self, step: int) -> None:
        """Wake the sessions of a step after those that are still to be woken."""
        is_idle = not self._due
        self._due.extend((step, session) for session in self._steps.pop(step))
        if is_idle:
            self._wake_due()

    def _wake_due(self) -> None:
        """Wake sessions for a while. Then messages and documents come before the others."""
        end = self._loop.time() + TURN
        while self._due and self._loop.time() <= end:
            step, session = self._due.popleft()
            when, own = self._times.get(session, (0.0, None))
            if own == step:
                del self._times[session]
                self._wake(session, when)
        if self._due:
            self._loop.call_soon(self._wake_due)


class ReadingTurns(Generic[T]):
    """The turns of the sessions that have documents to read, or a paused call to continue.

    Args:
        loop: the event loop.
        read: called with the session whose turn it is.
        must_wait: returns whether turns wait until it is time for their share.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        read: Callable[[T], None],
        must_wait: Callable[[], bool] = lambda: False,
    ) -> None:
        self._loop = loop
        self._read = read
        self._must_wait = must_wait
        self._waiting: dict[T, None] = {}
        self._next: asyncio.Handle | None = None
        self._until = loop.time()  # when the last turns ended
        self._excess = 0.0  # s that the last turns took beyond their share

    def add(self, session: T) -> None:
        """Give a session one turn."""
        self._waiting.setdefault(session)
        if self._next is None:
            self._next = self._loop.call_soon(self._take_turns)

    def close(self) -> None:
        """Forget the turns."""
        self._waiting.clear()

    def _take_turns(self) -> None:
        """Give sessions their turns for a share of the time. Then frames come again."""
        began = self._loop.time()
        share = min((began - self._until) * READING_SHARE, LONGEST_READING)
        if self._must_wait():
            share -= self._excess
            if share < 0.0:
                self._next = self._loop.call_soon(self._take_turns)
                return
        end = began + share
        while self._waiting:
            session = next(iter(self._waiting))
            del self._waiting[session]
            self._read(session)
            self._until = self._loop.time()
            if self._until >= end:
                break
        self._excess = min(max(0.0, self._until - end), LONGEST_READING)
        self._next = self._loop.call_soon(self._take_turns) if self._waiting else None
