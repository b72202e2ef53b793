"""What a piece of work takes, for the benchmarks beside this file."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

__all__ = ["median"]


def median(work: Callable[[], object], repeats: int = 15) -> float:
    """Milliseconds; the first run, which fills caches, does not count."""
    work()
    spent = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        spent.append(time.perf_counter() - began)
    return 1000 * statistics.median(spent)
