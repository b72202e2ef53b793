"""Measures the time of work and the noise of the machine, for the benchmarks in this folder."""

from __future__ import annotations

import argparse
import hashlib
import statistics
import time
from collections.abc import Callable

__all__ = ["Noise", "handle_help", "measure", "median", "noise"]

WORK = bytes(1 << 19)  # noise is measured by its digest, which takes half a millisecond


def handle_help(description: str | None) -> None:
    """Parse the command line of a script without options; `--help` prints the description."""
    form = argparse.RawDescriptionHelpFormatter
    argparse.ArgumentParser(description=description, formatter_class=form).parse_args()


def measure(work: Callable[[], object], least: float = 1.0) -> tuple[float, float, float]:
    """Return median, minimum and maximum milliseconds of a call, over about `least` seconds.

    The first call, which fills caches, does not count.
    """
    work()
    spans: list[float] = []
    until = time.perf_counter() + least
    while time.perf_counter() < until or len(spans) < 5:
        spans.append(_milliseconds(work))
    return statistics.median(spans), min(spans), max(spans)


def median(work: Callable[[], object], repeats: int = 15) -> float:
    """Return the median milliseconds of a call; the first call, which fills caches, does not count."""
    work()
    return statistics.median(_milliseconds(work) for _ in range(repeats))


def noise(samples: int = 500) -> str:
    """Return a line that says how much longer than at its best a fixed piece of work takes."""
    spans = [_milliseconds(_digest) for _ in range(samples)]
    tenths, least = statistics.quantiles(spans, n=10), min(spans)
    return (
        f"noise of this machine: the same work takes {tenths[4] / least - 1:.0%} longer than at its best, "
        f"90th percentile {tenths[8] / least - 1:.0%}"
    )


class Noise:
    """The noise of the machine between other work: how much slower than at its best it is."""

    least = float("inf")

    def __init__(self) -> None:
        self._seconds: list[float] = []

    def sample(self) -> float:
        """Measure once; return the elapsed seconds of the measurement."""
        begin, used = time.perf_counter(), time.process_time()
        _digest()
        self._seconds.append(time.process_time() - used)
        Noise.least = min(Noise.least, self._seconds[-1])
        return time.perf_counter() - begin

    @property
    def factor(self) -> float:
        """The mean time of the work divided by its least time."""
        return statistics.mean(self._seconds) / Noise.least

    def __str__(self) -> str:
        """Return median and 90th percentile in per cent."""
        tenths = statistics.quantiles(self._seconds, n=10)
        return "".join(f"{100 * (seconds / Noise.least - 1):7.0f} %" for seconds in (tenths[4], tenths[8]))


def _digest() -> None:
    hashlib.sha256(WORK).digest()


def _milliseconds(work: Callable[[], object]) -> float:
    begin = time.perf_counter()
    work()
    return 1000 * (time.perf_counter() - begin)
