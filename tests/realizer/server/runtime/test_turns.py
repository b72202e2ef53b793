"""Tests of the turns of sessions, in a loop whose clock moves when something says so."""

from __future__ import annotations

import contextvars
import threading
import weakref
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from typing import Any

import pytest

from realizer.core import work
from realizer.server.runtime.turns import (
    LONGEST_READING,
    READING_SHARE,
    SLICE,
    STEP,
    TURN,
    ReadingTurns,
    SlicedCalls,
    WakeUps,
)


class Loop:
    """An event loop that a test drives."""

    def __init__(self) -> None:
        self.now = 100.0
        self.timers: list[tuple[float, Callable[..., None], tuple[Any, ...]]] = []
        self.soon: list[Callable[[], None]] = []

    def time(self) -> float:
        return self.now

    def call_at(self, when: float, function: Callable[..., None], *arguments: Any) -> None:
        self.timers.append((when, function, arguments))

    def call_soon(self, function: Callable[[], None]) -> object:
        self.soon.append(function)
        return function

    def run(self, until: float) -> None:
        """Call what is due, in order."""
        while due := [timer for timer in self.timers if timer[0] <= until]:
            timer = min(due, key=lambda timer: timer[0])
            self.timers.remove(timer)
            self.now = max(self.now, timer[0])
            timer[1](*timer[2])
            self.run_soon()
        self.now = until

    def run_soon(self) -> None:
        while self.soon:
            self.soon.pop(0)()


@pytest.fixture
def loop() -> Loop:
    return Loop()


@pytest.fixture
def woken() -> list[tuple[str, float]]:
    return []


@pytest.fixture
def wake_ups(loop, woken) -> WakeUps[str]:
    return WakeUps(loop, lambda session, when: woken.append((session, when)))


def test_wake_ups_wake_each_session_once_at_its_time(loop, woken, wake_ups) -> None:
    for session, when in (("late", 101.0), ("soon", 100.25), ("past", 99.0), ("never", float("inf"))):
        wake_ups.set(session, when)
    loop.run(100.5)
    assert woken == [("past", 100.0), ("soon", 100.25)]
    loop.run(110.0)
    assert woken[2:] == [("late", 101.0)]


def test_wake_ups_of_a_step_share_a_timer(loop, woken, wake_ups) -> None:
    for k in range(4):
        wake_ups.set(f"s{k}", 100.5 + k * STEP / 4 - STEP / 2)
    assert len(loop.timers) == 2
    loop.run(101.0)
    assert [session for session, _ in woken] == ["s0", "s1", "s2", "s3"]


def test_wake_ups_replace_the_time_of_a_session_unless_it_is_due(loop, woken, wake_ups) -> None:
    wake_ups.set("a", 100.5)
    wake_ups.set("a", 100.2)
    wake_ups.set("b", 100.1)
    wake_ups.set("b", float("inf"))
    loop.run(102.0)
    assert woken == [("a", 100.2)]
    wake_ups.set("a", 102.0)
    wake_ups.set("a", 103.0)  # it is due already
    loop.run(102.0)
    assert woken == [("a", 100.2), ("a", 102.0)]


def test_wake_ups_let_others_in_after_a_while(loop) -> None:
    woken: list[str] = []

    def wake(session: str, when: float) -> None:
        woken.append(session)
        loop.now += 0.6 * TURN
        if session == "a":
            loop.soon.append(lambda: woken.append("message"))

    wake_ups = WakeUps(loop, wake)
    for session in "abcd":
        wake_ups.set(session, 100.5)
    loop.run(101.0)
    assert woken == ["a", "b", "message", "c", "d"]


def test_wake_ups_wake_nobody_after_they_are_closed(loop, woken, wake_ups) -> None:
    wake_ups.set("a", 100.5)
    wake_ups.close()
    wake_ups.set("b", 100.5)
    loop.run(101.0)
    assert woken == []


def test_reading_turns_take_a_share_of_the_time(loop) -> None:
    read: list[str] = []
    step = LONGEST_READING / 10

    def take(session: str) -> None:
        read.append(session)
        loop.now += step

    turns = ReadingTurns(loop, take)
    loop.now += 9.5 * step / READING_SHARE
    for k in range(30):
        turns.add(f"s{k}")
        turns.add(f"s{k}")
    loop.soon.pop(0)()
    assert len(read) == 10
    loop.now += 1.5 * step / READING_SHARE  # frames
    loop.soon.pop(0)()
    assert len(read) == 12
    loop.run_soon()
    assert read == [f"s{k}" for k in range(30)]


def test_reading_turns_give_no_turn_after_they_are_closed(loop) -> None:
    turns = ReadingTurns(loop, lambda session: pytest.fail("it is read"))
    turns.add("a")
    turns.close()
    loop.run_soon()
    assert not loop.soon


def test_reading_turns_that_must_wait_keep_to_their_share(loop) -> None:
    took = 0.0

    def take(session: str) -> None:
        nonlocal took
        loop.now += 0.004
        took += 0.004

    is_busy = True
    turns = ReadingTurns(loop, take, lambda: is_busy)
    for k in range(200):
        turns.add(f"s{k}")
    begin = loop.now
    while loop.now < begin + 1.0:
        loop.now += 0.0005  # a frame
        loop.soon.pop(0)()
    assert took == pytest.approx(READING_SHARE / (1 + READING_SHARE), abs=0.02)
    is_busy = False
    loop.run_soon()
    assert took == pytest.approx(200 * 0.004)


class Calls(SlicedCalls[str]):
    """Calls whose clock stands still but for `work_for`; `paused` has the owners of paused calls."""

    def __init__(self) -> None:
        self.now = 0.0
        self.paused: list[str] = []
        self.returned: SimpleQueue[str] = SimpleQueue()  # owners whose function in a thread has returned
        super().__init__(self.paused.append, lambda _, owner: self.returned.put(owner), lambda: self.now)

    def work_for(self, slices: float) -> None:
        """Work for so many slices of time."""
        end = self.now + slices * SLICE
        while self.now < end:
            self.now += SLICE / 10
            work.count()

    def finish(self) -> None:
        """Resume paused calls in turn until all have ended."""
        while self.paused:
            self.resume(self.paused.pop(0))


@pytest.fixture
def calls() -> Iterator[Calls]:
    calls = Calls()
    yield calls
    calls.close()


def test_sliced_calls_end_short_calls_at_once(calls) -> None:
    done: list[int] = []
    calls.call("a", lambda: (calls.work_for(0.5), done.append(1)))
    assert (done, calls.paused, calls.is_busy("a")) == ([1], [], False)


def test_sliced_calls_pause_long_calls(calls) -> None:
    done: list[int] = []
    calls.call("a", lambda: (calls.work_for(2.5), done.append(1)))
    assert (done, calls.paused, calls.is_busy("a")) == ([], ["a"], True)
    calls.finish()
    assert (done, calls.is_busy("a")) == ([1], False)


def test_sliced_calls_pause_a_call_after_as_many_slices_as_it_may_have(calls) -> None:
    done: list[int] = []
    calls.call("a", lambda: (calls.work_for(2.5), done.append(1)), slices=3)
    assert (done, calls.paused) == ([1], [])
    calls.call("a", lambda: (calls.work_for(4.5), done.append(2)), slices=3)
    assert (done, calls.paused) == ([1], ["a"])
    calls.resume("a")  # then it has one slice at a time
    assert done == [1]
    calls.resume("a")
    assert done == [1, 2]


def test_sliced_calls_give_others_their_turn(calls) -> None:
    done: list[str] = []
    for owner, slices in (("long", 5), ("short", 2), ("tiny", 0)):
        calls.call(owner, lambda owner=owner, slices=slices: (calls.work_for(slices), done.append(owner)))
    calls.finish()
    assert done == ["tiny", "short", "long"]


def test_sliced_calls_keep_the_order_of_an_owner(calls) -> None:
    done: list[int] = []
    for n, slices in enumerate((2, 0, 3, 0)):
        calls.call("a", lambda n=n, slices=slices: (calls.work_for(slices), done.append(n)))
    assert done == []
    calls.finish()
    assert done == [0, 1, 2, 3]


def test_sliced_calls_make_inner_calls_of_an_owner_at_once(calls) -> None:
    done: list[str] = []

    def outer() -> None:
        calls.work_for(2)
        calls.call("a", lambda: done.append("inner"))
        done.append("outer")

    calls.call("a", outer)
    calls.finish()
    assert done == ["inner", "outer"]


def test_sliced_calls_pause_within_a_call_of_another_owner(calls) -> None:
    done: list[str] = []

    def outer() -> None:
        calls.call("b", lambda: (calls.work_for(2), done.append("b")))
        done.append("a")

    calls.call("a", outer)
    assert (done, calls.is_busy("a"), calls.is_busy("b")) == (["a"], False, True)
    calls.finish()
    assert done == ["a", "b"]


def test_sliced_calls_leave_callbacks_alone_that_a_call_has_scheduled(calls) -> None:
    """They have its context: asyncio copies it."""
    contexts: list[contextvars.Context] = []
    calls.call("a", lambda: contexts.append(contextvars.copy_context()))
    contexts[0].run(calls.work_for, 2)
    assert contexts[0].run(work.call_native, max, 1, 2) == 2
    assert calls.paused == []


def test_sliced_calls_cancel_a_call_where_it_is(calls) -> None:
    done: list[str] = []

    def call() -> None:
        try:
            calls.work_for(3)
            done.append("end")
        finally:
            done.append("cleaned up")

    calls.call("a", call)
    calls.call("a", lambda: done.append("next"))
    calls.cancel("a")
    calls.finish()
    assert (done, calls.is_busy("a")) == (["cleaned up"], False)
    calls.call("a", lambda: done.append("new"))
    assert done[-1] == "new"


def test_sliced_calls_give_others_their_turn_while_a_thread_works(calls) -> None:
    done: list[str] = []
    may_end = threading.Event()
    calls.call("a", lambda: done.append(str(work.call_native(may_end.wait))))
    calls.call("b", lambda: done.append("b"))
    calls.resume("a")
    assert (done, calls.paused, calls.is_busy("a")) == (["b"], [], True)
    may_end.set()
    assert calls.returned.get() == "a"
    calls.resume("a")
    assert (done, calls.is_busy("a")) == (["b", "True"], False)


def test_sliced_calls_ignore_the_thread_of_a_call_that_was_cancelled(calls) -> None:
    done: list[str] = []
    may_end = threading.Event()
    calls.call("a", lambda: done.append(str(work.call_native(may_end.wait))))
    calls.cancel("a")
    calls.call("a", lambda: (calls.work_for(2), done.append("new")))
    may_end.set()
    assert calls.returned.get() == "a"
    calls.resume("a")
    calls.finish()
    assert done == ["new"]


def test_sliced_calls_call_no_function_for_a_call_that_was_cancelled(calls) -> None:
    done: list[str] = []
    may_end = threading.Event()
    calls.call("a", lambda: work.call_native(may_end.wait))
    calls.call("b", lambda: work.call_native(done.append, "b"))
    calls.call("c", lambda: work.call_native(done.append, "c"))
    calls.cancel("b")
    may_end.set()
    while calls.returned.get() != "c":
        pass
    assert done == ["c"]


def test_sliced_calls_let_go_of_owners_whose_calls_have_ended() -> None:
    class Owner:
        pass

    calls = SlicedCalls[Owner](lambda owner: None, lambda function, owner: None)
    calls.call(owner := Owner(), lambda: None)
    ended = weakref.ref(owner)
    del owner
    assert ended() is None
    calls.close()


def test_sliced_calls_raise_the_exception_of_a_thread_in_its_call(calls) -> None:
    def fail() -> None:
        with pytest.raises(ZeroDivisionError):
            work.call_native(divmod, 1, 0)

    calls.call("a", fail)
    calls.resume(calls.returned.get())
    assert not calls.is_busy("a")


@pytest.mark.parametrize("slices", [0, 2])
def test_sliced_calls_raise_exceptions_of_a_call(calls, slices) -> None:
    def fail() -> None:
        calls.work_for(slices)
        raise ValueError("a fault of the call")

    def make() -> None:
        calls.call("a", fail)
        calls.finish()

    with pytest.raises(ValueError, match="of the call"):
        make()
    assert not calls.is_busy("a")


def test_sliced_calls_limit_work_of_each_call_alone(calls) -> None:
    failed: list[str] = []

    def limited(owner: str, steps: int) -> Callable[[], None]:
        def call() -> None:
            try:
                with work.limited(steps):
                    calls.work_for(3)
            except work.WorkLimitError:
                failed.append(owner)

        return call

    calls.call("a", limited("a", 20))
    calls.call("b", limited("b", 100))
    calls.finish()
    assert failed == ["a"]
