"""Tests of the turns of sessions, in a loop whose clock moves when something says so."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from realizer.server.runtime.turns import LONGEST_READING, READING_SHARE, STEP, TURN, ReadingTurns, WakeUps


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
