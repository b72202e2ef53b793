"""Things and the times at which they want to be woken in, one timer of the event loop for all of them out."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Hashable
from heapq import heapify, heappop, heappush
from typing import Generic, Protocol, TypeVar

__all__: list[str] = []

T = TypeVar("T", bound=Hashable)

# Nobody is woken for less: what is due within it is woken together.
STEP = 0.001  # s
# How long things are woken one after the other before the loop looks for messages again.
TURN = 0.004  # s
NEVER = float("inf")
_Entry = tuple[float, int, T]


class Timers(Protocol):
    """What is wanted of an event loop."""

    def time(self) -> float:
        """Seconds."""
        ...

    def call_at(self, when: float, callback: Callable[[], None]) -> asyncio.TimerHandle:
        """Call it then."""
        ...


class Alarms(Generic[T]):
    """Wakes each thing once for each time it was set.

    Args:
        loop: whose clock the times are on.
        wake: (thing, the time it was set to); what it raises ends nothing but that call.
    """

    def __init__(self, loop: Timers, wake: Callable[[T, float], None]) -> None:
        self._loop = loop
        self._wake = wake
        self._numbers = itertools.count()
        self._set: dict[T, _Entry[T]] = {}
        self._heap: list[_Entry[T]] = []  # and such as have been set anew since
        self._timer: asyncio.Handle | None = None
        self._rings = NEVER  # when the timer is due
        self._ringing = False
        self._closed = False

    def set(self, thing: T, when: float) -> None:
        """Wake it at `when` instead of whatever was set before; infinite: not at all.

        One that is due already is left alone: who is set anew in quick succession is not put off for ever.
        """
        known = self._set.get(thing)
        if known is not None:
            if when < NEVER and (known[0] == when or known[0] <= min(when, self._loop.time())):
                return
            del self._set[thing]
        if when == NEVER or self._closed:
            return
        entry = self._set[thing] = (when, next(self._numbers), thing)
        heappush(self._heap, entry)
        if len(self._heap) > 2 * len(self._set) + 64:
            self._heap = list(self._set.values())
            heapify(self._heap)
        if not self._ringing and when < self._rings:
            self._arm(when)

    def close(self) -> None:
        """Wake nobody any more."""
        self._closed = True
        self._set.clear()
        self._heap.clear()
        if self._timer is not None:
            self._timer.cancel()

    def _arm(self, when: float) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._rings = when
        self._timer = self._loop.call_at(when, self._ring)

    def _ring(self) -> None:
        """Wake all that are due, as long as it is our turn."""
        self._timer, self._rings, self._ringing = None, NEVER, True
        now = self._loop.time()
        over = now + TURN
        try:
            while self._heap:
                entry = self._heap[0]
                when, _, thing = entry
                if self._set.get(thing) is not entry:
                    heappop(self._heap)
                    continue
                if when > now or now > over:
                    break
                heappop(self._heap)
                del self._set[thing]
                self._wake(thing, when)
                now = self._loop.time()
        finally:
            self._ringing = False
            if self._heap:
                self._arm(max(self._heap[0][0], now + STEP))
