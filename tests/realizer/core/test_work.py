"""Counted work: limits and pauses."""

from __future__ import annotations

import contextvars
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from typing import Any

import pytest

from realizer.core import work
from realizer.server.runtime.engines import FairPool
from tests.waiting import LIMIT


@pytest.mark.parametrize(("steps", "limit", "fits"), [(9, 10, True), (10, 10, True), (11, 10, False)])
def test_limited_work_ends_at_its_limit(steps: int, limit: int, fits: bool) -> None:
    done: list[int] = []

    def count() -> None:
        with work.limited(limit):
            for step in range(steps):
                work.count()
                done.append(step)

    if fits:
        count()
    else:
        with pytest.raises(work.WorkLimitError, match=str(limit)):
            count()
    assert len(done) == min(steps, limit)


def test_limited_work_counts_alone_inside_other_limited_work() -> None:
    with work.limited(10):
        with work.limited(100):
            work.count(50)
        work.count(10)
        with pytest.raises(work.WorkLimitError):
            work.count()


def test_count_without_a_limit_never_fails() -> None:
    work.count(10**12)


@pytest.mark.parametrize("items", [0, 1, 15, 16, 17, 100])
def test_counted_yields_all_items_and_counts_them(items: int) -> None:
    assert list(work.counted(range(items), 3)) == list(range(items))
    with pytest.raises(work.WorkLimitError), work.limited(3 * items):
        list(work.counted(range(items + work.TOGETHER), 3))


class Pauses:
    """Counts pauses and the functions that were called natively."""

    def __init__(self) -> None:
        self.count = 0
        self.called: list[Any] = []

    def pause(self) -> None:
        self.count += 1

    def wait_for(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        self.called.append(function)
        return function(*args, **kwargs)


def test_pause_with_sets_the_pauser_of_its_context() -> None:
    pauses = Pauses()

    def paused() -> None:
        work.pause_with(pauses)
        work.count(5)
        work.count()
        assert work.call_native(max, 1, 2) == 2

    contextvars.copy_context().run(paused)
    work.count()
    assert work.call_native(min, 1, 2) == 1
    assert (pauses.count, pauses.called) == (2, [max])


class Blocked(FairPool):
    """A pool of one thread, which waits until it is released."""

    def __init__(self) -> None:
        super().__init__(1, "test")
        self.done: list[str] = []
        self.release = threading.Event()
        begun = threading.Event()
        self.submit("first", lambda: (begun.set(), self.release.wait(LIMIT)))
        assert begun.wait(LIMIT)

    def add(self, owner: str, call: str) -> Future[Any]:
        return self.submit(owner, lambda: self.done.append(call))


@pytest.fixture
def pool() -> Iterator[Blocked]:
    pool = Blocked()
    yield pool
    pool.release.set()
    pool.close()


def test_fair_pool_serves_owners_in_turn(pool) -> None:
    calls = [pool.add("a", f"a{n}") for n in range(5)] + [pool.add("b", f"b{n}") for n in range(2)]
    calls.append(pool.add("c", "c0"))
    pool.release.set()
    for call in calls:
        call.result(LIMIT)
    assert pool.done == ["a0", "b0", "c0", "a1", "b1", "a2", "a3", "a4"]


def test_fair_pool_drops_the_calls_of_one_owner(pool) -> None:
    dropped = [pool.add("a", f"a{n}") for n in range(3)]
    kept = [pool.add("b", "b0"), pool.add("a2", "a2")]
    pool.drop("a")
    pool.drop("nobody")
    later = pool.add("a", "later")
    pool.release.set()
    for call in (*kept, later):
        call.result(LIMIT)
    assert pool.done == ["b0", "a2", "later"]
    for call in dropped:
        with pytest.raises(CancelledError):
            call.result(LIMIT)


def test_fair_pool_returns_results_and_exceptions(pool) -> None:
    good, bad = pool.submit("a", lambda: 3), pool.submit("a", lambda: [][1])
    pool.release.set()
    assert good.result(LIMIT) == 3
    with pytest.raises(IndexError):
        bad.result(LIMIT)
    assert pool.submit("a", lambda: 4).result(LIMIT) == 4


def test_fair_pool_skips_calls_that_were_cancelled(pool) -> None:
    calls = [pool.add("a", f"a{n}") for n in range(3)]
    assert calls[1].cancel()
    pool.release.set()
    calls[2].result(LIMIT)
    assert pool.done == ["a0", "a2"]
