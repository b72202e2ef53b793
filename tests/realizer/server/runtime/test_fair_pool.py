"""The pool of threads that serves its users in turn."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from typing import Any

import pytest

from realizer.server.runtime.engines import FairPool


class Blocked(FairPool):
    """A pool of one thread, which waits until it is released."""

    def __init__(self) -> None:
        super().__init__(1, "test")
        self.done: list[str] = []
        self.release = threading.Event()
        begun = threading.Event()
        self.submit("first", lambda: (begun.set(), self.release.wait(60)))
        assert begun.wait(60)

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
        call.result(60)
    assert pool.done == ["a0", "b0", "c0", "a1", "b1", "a2", "a3", "a4"]


def test_fair_pool_drops_the_calls_of_one_owner(pool) -> None:
    dropped = [pool.add("a", f"a{n}") for n in range(3)]
    kept = [pool.add("b", "b0"), pool.add("a2", "a2")]
    pool.drop("a")
    pool.drop("nobody")
    later = pool.add("a", "later")
    pool.release.set()
    for call in (*kept, later):
        call.result(60)
    assert pool.done == ["b0", "a2", "later"]
    for call in dropped:
        with pytest.raises(CancelledError):
            call.result(60)


def test_fair_pool_returns_results_and_exceptions(pool) -> None:
    good, bad = pool.submit("a", lambda: 3), pool.submit("a", lambda: [][1])
    pool.release.set()
    assert good.result(60) == 3
    with pytest.raises(IndexError):
        bad.result(60)
    assert pool.submit("a", lambda: 4).result(60) == 4


def test_fair_pool_skips_calls_that_were_cancelled(pool) -> None:
    calls = [pool.add("a", f"a{n}") for n in range(3)]
    assert calls[1].cancel()
    pool.release.set()
    calls[2].result(60)
    assert pool.done == ["a0", "a2"]
