"""The timer wheel: one timer for many items, in order of their times."""

from __future__ import annotations

import asyncio
import heapq
import itertools
from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from realizer.server.runtime.timer_wheel import NEVER, STEP, TURN, TimerWheel


class Clock:
    """A clock with timers, which goes from one to the next at no time at all."""

    def __init__(self) -> None:
        self.now = 0.0
        self._timers: list[tuple[float, int, asyncio.TimerHandle]] = []
        self._numbers = itertools.count()
        self.loop = asyncio.new_event_loop()
        self.loop.close()  # a handle wants one, though it asks it for nothing

    def time(self) -> float:
        return self.now

    def call_at(self, when: float, callback: Callable[[], None]) -> asyncio.TimerHandle:
        handle = asyncio.TimerHandle(when, callback, (), self.loop)
        heapq.heappush(self._timers, (when, next(self._numbers), handle))
        return handle

    def run(self, until: float) -> int:
        """Returns how many timers rang."""
        rang = 0
        while self._timers and self._timers[0][0] <= until:
            when, _, handle = heapq.heappop(self._timers)
            self.now = max(self.now, when)
            if not handle.cancelled():
                rang += 1
                handle._run()
        self.now = until
        return rang


def alarms(clock: Clock, *, costs: float = 0.0) -> tuple[TimerWheel[str], list[tuple[str, float, float]]]:
    """Return a wheel and its calls: (item, its time, the time of the call)."""
    woken: list[tuple[str, float, float]] = []

    def wake(thing: str, when: float) -> None:
        woken.append((thing, when, clock.now))
        clock.now += costs

    return TimerWheel(clock, wake), woken


def test_timer_wheel_wakes_each_item_once_at_its_time() -> None:
    clock = Clock()
    some, woken = alarms(clock)
    for thing, when in (("b", 2.0), ("a", 1.0), ("c", 3.0)):
        some.schedule(thing, when)
    clock.run(2.5)
    assert woken == [("a", 1.0, 1.0), ("b", 2.0, 2.0)]
    clock.run(9.0)
    assert [thing for thing, *_ in woken] == ["a", "b", "c"]


def test_timer_wheel_wakes_a_rescheduled_item_at_its_new_time_only() -> None:
    clock = Clock()
    some, woken = alarms(clock)
    some.schedule("a", 1.0)
    some.schedule("a", 3.0)
    some.schedule("b", 3.0)
    some.schedule("b", 2.0)
    some.schedule("c", 2.0)
    some.schedule("c", NEVER)
    clock.run(9.0)
    assert woken == [("b", 2.0, 2.0), ("a", 3.0, 3.0)]


def test_timer_wheel_does_not_postpone_an_item_that_is_due() -> None:
    clock = Clock()
    some, woken = alarms(clock)
    some.schedule("a", 1.0)
    clock.now = 1.5
    some.schedule("a", 1.6)
    clock.run(1.55)
    assert woken == [("a", 1.0, 1.5)]


def test_timer_wheel_needs_one_timer_for_a_step() -> None:
    clock = Clock()
    some, woken = alarms(clock)
    for k in range(100):
        some.schedule(str(k), 1.0 + k * STEP / 100)
    assert clock.run(2.0) <= 3
    assert len(woken) == 100
    assert all(was - wanted <= STEP for _, wanted, was in woken)


def test_timer_wheel_lets_the_loop_run_between_many_items() -> None:
    clock = Clock()
    some, woken = alarms(clock, costs=TURN / 2)
    for k in range(12):
        some.schedule(str(k), 1.0)
    assert clock.run(2.0) >= 4
    assert [thing for thing, *_ in woken] == [str(k) for k in range(12)]


def test_timer_wheel_item_may_schedule_itself_while_it_is_woken() -> None:
    clock = Clock()
    woken: list[float] = []

    def wake(thing: str, when: float) -> None:
        woken.append(when)
        some.schedule(thing, when + 1.0)

    some = TimerWheel(clock, wake)
    some.schedule("a", 1.0)
    clock.run(4.5)
    assert woken == [1.0, 2.0, 3.0, 4.0]


def test_timer_wheel_survives_an_item_that_fails() -> None:
    clock = Clock()
    woken: list[str] = []
    clock.loop.set_exception_handler(lambda loop, context: None)

    def wake(thing: str, when: float) -> None:
        woken.append(thing)
        if thing == "a":
            raise ValueError(thing)

    some = TimerWheel(clock, wake)
    some.schedule("a", 1.0)
    some.schedule("b", 1.0)
    clock.run(2.0)
    assert woken == ["a", "b"]


def test_timer_wheel_wakes_nothing_after_close() -> None:
    clock = Clock()
    some, woken = alarms(clock)
    some.schedule("a", 1.0)
    some.close()
    some.schedule("b", 1.0)
    clock.run(2.0)
    assert woken == []


@given(st.lists(st.tuples(st.integers(0, 5), st.just(NEVER) | st.floats(0, 10)), max_size=300))
def test_timer_wheel_uses_the_last_time_of_each_item(steps: list[tuple[int, float]]) -> None:
    clock = Clock()
    some, woken = alarms(clock)
    last: dict[str, float] = {}
    for thing, when in steps:
        some.schedule(str(thing), when)
        if last.get(str(thing)) != 0.0 or when == NEVER:  # one that is due already stays
            last[str(thing)] = when
    clock.run(20.0)
    assert {thing: when for thing, when, _ in woken} == {t: w for t, w in last.items() if w < NEVER}
    assert len(woken) == len({thing for thing, *_ in woken})
    assert all(wanted - STEP / 1000 <= was <= wanted + 2 * STEP for _, wanted, was in woken)
