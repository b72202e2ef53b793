"""A timer wheel: many wake-up times share one event loop timer."""

from __future__ import annotations

import asyncio
import math
from collections import deque
from collections.abc import Callable, Hashable
from heapq import heappop, heappush
from typing import Generic, Protocol, TypeVar

T = TypeVar("T", bound=Hashable)

# What is due between two whole steps of the clock is woken at the second; so little before one is at it.
STEP = 0.001  # s
SLACK = 5e-4  # of a step
# How long things are woken one after the other before the loop looks for messages again.
TURN = 0.004  # s
NEVER = float("inf")


class Timers(Protocol):
    """What is wanted of an event loop."""

    def time(self) -> float:
        """Seconds."""
        ...

    def call_at(self, when: float, callback: Callable[[], None]) -> asyncio.TimerHandle:
        """Call it then."""
        ...


class TimerWheel(Generic[T]):
    """Wakes each thing once for each time it was set.

    Args:
        loop: whose clock the times are on.
        wake: (thing, the time it was set to); what it raises ends nothing but that call.
    """

    def __init__(self, loop: Timers, wake: Callable[[T, float], None]) -> None:
        self._loop = loop
        self._wake = wake
        self._set: dict[T, tuple[float, int]] = {}  # when, and the step it is woken at
        self._steps: dict[int, deque[T]] = {}  # who is woken at each, and who was set anew since
        self._order: list[int] = []  # the steps, as a heap
        self._entries = 0
        self._reached = 0  # no step before it is looked at any more
        self._timer: asyncio.Handle | None = None
        self._rings = math.inf  # the step at which the timer is due
        self._ringing = False
        self._closed = False

    def schedule(self, thing: T, when: float) -> None:
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
        reached = self._reached
        step = reached if when <= reached * STEP else math.ceil(when / STEP - SLACK)
        self._set[thing] = (when, step)
        self._put(thing, step)
        if not self._ringing:
            if self._entries > 2 * len(self._set) + 64:
                self._tidy()
            if step < self._rings:
                self._arm(step)

    def close(self) -> None:
        """Wake nobody any more."""
        self._closed = True
        self._set.clear()
        self._tidy()
        if self._timer is not None:
            self._timer.cancel()

    def _put(self, thing: T, step: int) -> None:
        there = self._steps.get(step)
        if there is None:
            there = self._steps[step] = deque()
            heappush(self._order, step)
        there.append(thing)
        self._entries += 1

    def _tidy(self) -> None:
        """Forget what was set anew since."""
        self._steps, self._order, self._entries = {}, [], 0
        for thing, (_, step) in self._set.items():
            self._put(thing, step)

    def _arm(self, step: int) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._rings = step
        self._timer = self._loop.call_at(step * STEP, self._fire)

    def _fire(self) -> None:
        """Wake all that are due, as long as it is our turn."""
        self._timer, self._rings, self._ringing = None, math.inf, True
        now = self._loop.time()
        over = now + TURN
        try:
            while self._order and self._order[0] <= now / STEP + SLACK and now <= over:
                step = self._reached = self._order[0]
                there = self._steps[step]
                while there and now <= over:
                    thing = there.popleft()
                    self._entries -= 1
                    known = self._set.get(thing)
                    if known is not None and known[1] == step:
                        del self._set[thing]
                        self._wake(thing, known[0])
                        now = self._loop.time()
                if not there:
                    heappop(self._order)
                    del self._steps[step]
        finally:
            self._ringing = False
            if self._order:
                self._arm(max(self._order[0], math.floor(now / STEP + SLACK) + 1))
