"""The time axis: positions of times and labelled ticks."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from realizer.charts.timeline import BlockChart

GUTTER = 190.0  # where the names stand
MARGIN = 26.0  # on the right
WIDTH = 1200.0
# A second is at least this wide, until the picture is WIDEST.
SECOND, WIDEST = 90.0, 4000.0
APART = 64.0  # least distance of two times on the axis


@dataclass(frozen=True)
class Scale:
    """Session seconds `first` .. `last` on a picture of `width` pixels."""

    first: float
    last: float
    width: float

    @property
    def left(self) -> float:
        return GUTTER

    @property
    def right(self) -> float:
        return self.width - MARGIN

    @property
    def second(self) -> float:
        """Pixels."""
        return (self.right - self.left) / (self.last - self.first)

    def x(self, time: float) -> float:
        """Return the position of a time, limited to the picture."""
        return min(max(self.left + (time - self.first) * self.second, self.left), self.right)

    def ticks(self) -> Iterator[tuple[float, str]]:
        """Yield round times and their labels."""
        step = next(s for s in _steps() if s * self.second >= APART)
        digits = max(0, -math.floor(math.log10(step) + 1e-9))
        for number in range(math.ceil(self.first / step - 1e-9), math.floor(self.last / step + 1e-9) + 1):
            yield number * step, f"{number * step:.{digits}f}"


def scale_of(blocks: Iterable[BlockChart]) -> Scale:
    """Return a scale for all blocks; one that has not started begins at 0."""
    spans = [(block.start or 0.0, last_of(block)) for block in blocks]
    first = min((start for start, _ in spans), default=0.0)
    last = max((end for _, end in spans), default=0.0)
    last = max(last, first + 0.1)
    return Scale(first, last, min(WIDEST, max(WIDTH, GUTTER + MARGIN + SECOND * (last - first))))


def last_of(block: BlockChart) -> float:
    """Return when a block ends, as if a block that has not started began at 0."""
    ends = [line.points[-1].time for line in block.rows]
    return (block.start or 0.0) + max(ends, default=0.0)


def _steps() -> Iterator[float]:
    """Yield 0.01, 0.02, 0.05, 0.1, ..."""
    power = -2
    while True:
        yield from (base * 10.0**power for base in (1, 2, 5))
        power += 1
