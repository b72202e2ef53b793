"""What a piece of work takes, and how noisy the machine is meanwhile, for the benchmarks beside this file."""

from __future__ import annotations

import argparse
import hashlib
import statistics
import time
from collections.abc import Callable

__all__ = ["Noise", "helped", "measure", "median", "noise"]

WORK = bytes(1 << 19)  # whose digest takes half a millisecond: what noise is measured by


def helped(says: str | None) -> None:
    """`--help` of a script without options prints what it says of itself."""
    form = argparse.RawDescriptionHelpFormatter
    argparse.ArgumentParser(description=says, formatter_class=form).parse_args()


def measure(work: Callable[[], object], least: float = 1.0) -> tuple[float, float, float]:
    """(median, minimum, maximum) milliseconds of one call, over about `least` seconds.

    The first run, which fills caches, does not count.
    """
    work()
    spans: list[float] = []
    until = time.perf_counter() + least
    while time.perf_counter() < until or len(spans) < 5:
        spans.append(_milliseconds(work))
    return statistics.median(spans), min(spans), max(spans)


def median(work: Callable[[], object], repeats: int = 15) -> float:
    """Milliseconds; the first run, which fills caches, does not count."""
    work()
    return statistics.median(_milliseconds(work) for _ in range(repeats))


def noise(looks: int = 500) -> str:
    """A line that says how much longer a fixed piece of work takes than at its best, by clock."""
    spans = [_milliseconds(_digest) for _ in range(looks)]
    tenths, least = statistics.quantiles(spans, n=10), min(spans)
    return (
        f"noise of this machine: the same work takes {tenths[4] / least - 1:.0%} longer than at its best, "
        f"{tenths[8] / least - 1:.0%} in nine of ten"
    )


class Noise:
    """What else the machine does to the processor's time between other work: looked at again and again."""

    least = float("inf")

    def __init__(self) -> None:
        self._took: list[float] = []

    def look(self) -> float:
        """Do the work once; s, by clock."""
        began, used = time.perf_counter(), time.process_time()
        _digest()
        self._took.append(time.process_time() - used)
        Noise.least = min(Noise.least, self._took[-1])
        return time.perf_counter() - began

    @property
    def factor(self) -> float:
        """How much slower than at its best the machine was, on average."""
        return statistics.mean(self._took) / Noise.least

    def __str__(self) -> str:
        """Median and nine in ten, per cent."""
        tenths = statistics.quantiles(self._took, n=10)
        return "".join(f"{100 * (took / Noise.least - 1):7.0f} %" for took in (tenths[4], tenths[8]))


def _digest() -> None:
    hashlib.sha256(WORK).digest()


def _milliseconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - began)
