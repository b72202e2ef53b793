"""A timer wheel: many wake-up times share one event loop timer."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Hashable
from heapq import heappop, heappush
from typing import Generic, Protocol, TypeVar

T = TypeVar("T", bound=Hashable)

# Times are rounded up to whole steps of the clock, except those so little after a step.
STEP = 0.001  # s
SLACK = 5e-4  # of a step
TURN = 0.004  # s; after so long the event loop may handle messages before the next call
NEVER = float("inf")


class Timers(Protocol):
    """The methods of an event loop that the timer wheel calls."""

    def time(self) -> float: ...

    def call_at(self, when: float, callback: Callable[[], None]) -> asyncio.TimerHandle: ...


class TimerWheel(Generic[T]):
    """A timer wheel: one wake-up time for each of many items.

    Args:
        loop: the event loop, whose clock the times are on.
        wake: (item, its time), called once when it is due; an exception ends that call only.
    """

    def __init__(self, loop: Timers, wake: Callable[[T, float], None]) -> None:
        self._loop = loop
        self._wake = wake
        self._set: dict[T, tuple[float, int]] = {}  # item -> its time and step
        self._steps: dict[int, deque[T]] = {}  # step -> its items, and items scheduled for another step since
        self._order: list[int] = []  # the steps, as a heap
        self._entries = 0  # number of items in `_steps`
        self._reached = 0  # the first step that may have items
        self._timer: asyncio.Handle | None = None
        self._rings = math.inf  # the step at which the timer is due
        self._ringing = False
        self._closed = False

    def schedule(self, item: T, when: float) -> None:
        """Schedule an item for a time, instead of the one before; infinite: never.

        An item that is already due stays so, or one that is rescheduled all the time would never be woken.
        """
        known = self._set.get(item)
        if known is not None:
            if when < NEVER and (known[0] == when or known[0] <= min(when, self._loop.time())):
                return
            del self._set[item]
        if when == NEVER or self._closed:
            return
        reached = self._reached
        step = reached if when <= reached * STEP else math.ceil(when / STEP - SLACK)
        self._set[item] = (when, step)
        self._put(item, step)
        if not self._ringing:
            if self._entries > 2 * len(self._set) + 64:
                self._tidy()
            if step < self._rings:
                self._arm(step)

    def close(self) -> None:
        """Cancel everything."""
        self._closed = True
        self._set.clear()
        self._tidy()
        if self._timer is not None:
            self._timer.cancel()

    def _put(self, item: T, step: int) -> None:
        items = self._steps.get(step)
        if items is None:
            items = self._steps[step] = deque()
            heappush(self._order, step)
        items.append(item)
        self._entries += 1

    def _tidy(self) -> None:
        """Remove items from the steps they were scheduled for before."""
        self._steps, self._order, self._entries = {}, [], 0
        for item, (_, step) in self._set.items():
            self._put(item, step)

    def _arm(self, step: int) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._rings = step
        self._timer = self._loop.call_at(step * STEP, self._fire)

    def _fire(self) -> None:
        """Wake the items that are due, for at most `TURN`."""
        self._timer, self._rings, self._ringing = None, math.inf, True
        now = self._loop.time()
        over = now + TURN
        try:
            while self._order and self._order[0] <= now / STEP + SLACK and now <= over:
                step = self._reached = self._order[0]
                items = self._steps[step]
                while items and now <= over:
                    item = items.popleft()
                    self._entries -= 1
                    known = self._set.get(item)
                    if known is not None and known[1] == step:
                        del self._set[item]
                        self._wake(item, known[0])
                        now = self._loop.time()
                if not items:
                    heappop(self._order)
                    del self._steps[step]
        finally:
            self._ringing = False
            if self._order:
                self._arm(max(self._order[0], math.floor(now / STEP + SLACK) + 1))
