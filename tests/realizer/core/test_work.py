"""Counted work: limits and pauses."""

from __future__ import annotations

import contextvars
from collections.abc import Callable
from typing import Any

import pytest

from realizer.core import work


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
