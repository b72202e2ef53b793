"""Tests of timings from the table."""

from __future__ import annotations

import pytest

from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.table_timing import from_gaps, table_timing, timing_from_table
from realizer.tables.timing import all_gaps, gaps
from tests.rows import each_row


@each_row("name", sorted(all_gaps()))
def test_timing_from_table_has_the_gaps_of_the_table(name: str) -> None:
    element, _, variant = name.partition(".")
    timing, row = timing_from_table(element, variant), gaps(element, variant)
    assert timing.points == row.points
    assert timing.preferred.tolist() == [gap.preferred for gap in row.gaps]
    assert timing.least.tolist() == [gap.least for gap in row.gaps]
    assert timing.stiffness.tolist() == [gap.stiffness for gap in row.gaps]
    assert not timing.rigid


def test_from_gaps_shares_arrays_that_cannot_be_written() -> None:
    row = gaps("head")
    assert from_gaps(row.points, row.gaps) is from_gaps(row.points, row.gaps)
    with pytest.raises(ValueError, match="read-only"):
        from_gaps(row.points, row.gaps).preferred[0] = 1.0


def test_table_timing_is_that_of_the_element() -> None:
    assert table_timing("blink")(None, PlanningContext()) is timing_from_table("blink")
