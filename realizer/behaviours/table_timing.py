"""The timing of behaviours that timing.toml describes completely."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from realizer.scheduling.timing import Timing
from realizer.tables.timing import Gap, gaps


def timing_from_table(element: str, variant: str = "") -> Timing:
    """What `element` wants of time; `variant` is a lexeme or an influence that may want other times."""
    row = gaps(element, variant)
    return from_gaps(row.points, row.gaps)


@lru_cache(maxsize=1000)
def from_gaps(points: tuple[str, ...], gaps: tuple[Gap, ...]) -> Timing:
    """k points and the k-1 gaps between them."""
    rows = np.array([(gap.preferred, gap.least, gap.stiffness) for gap in gaps]).T
    rows.setflags(write=False)  # all behaviours of a kind share them
    return Timing(points, *rows)
