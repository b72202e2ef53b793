"""The timing of behaviours that timing.toml describes completely."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.behaviours.kind import PlanningContext
from realizer.scheduling.timing import Timing
from realizer.tables.timing import Gap, gaps


def timing_from_table(element: str, variant: str = "") -> Timing:
    """Return the timing of an element; a `variant` is a lexeme or an influence with a timing of its own."""
    row = gaps(element, variant)
    return from_gaps(row.points, row.gaps)


def table_timing(element: str) -> Callable[[Any, PlanningContext], Timing]:
    """Return the function `timing` of a behaviour whose timing is always that of its element."""
    return lambda node, context: timing_from_table(element)


@lru_cache(maxsize=1000)
def from_gaps(points: tuple[str, ...], gaps: tuple[Gap, ...]) -> Timing:
    """Return the timing of k points and the k-1 gaps between them."""
    rows = np.array([(gap.preferred, gap.least, gap.stiffness) for gap in gaps]).T
    rows.setflags(write=False)  # shared by all behaviours of a kind
    return Timing(points, *rows)
