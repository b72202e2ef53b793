"""Tests of the interface of behaviours."""

import numpy as np
import pytest

from bml_schema import Wait
from realizer.behaviours.kind import (
    BehaviourKind,
    PlanningContext,
    claiming,
    from_gaps,
    table_timing,
    timing_from_table,
)
from realizer.tables.timing import all_gaps, gaps
from tests.rows import each_row

WAIT = Wait(id="w")
CONTEXT = PlanningContext()


def test_behaviour_kind_has_the_tag_of_its_node() -> None:
    assert BehaviourKind(Wait, table_timing("wait")).tag == Wait.tag


def test_behaviour_kind_plays_nothing_by_default() -> None:
    kind = BehaviourKind(Wait, table_timing("wait"))
    assert kind.expand(WAIT, np.array([0.0, 1.0]), CONTEXT) == ()
    assert kind.check(WAIT, CONTEXT) == ()
    assert kind.claims(WAIT, CONTEXT) == frozenset()
    assert (
        kind.sound(WAIT, CONTEXT)
        is kind.stretch(WAIT, CONTEXT)
        is kind.speech_request
        is kind.command
        is None
    )


def test_claiming_needs_its_resource_always() -> None:
    assert claiming("voice")(WAIT, CONTEXT) == {"voice"}


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


@pytest.mark.parametrize("row", [("blink",), ("faceLexeme", "RAISE_BROWS")])
def test_table_timing_is_that_of_the_row(row: tuple[str, ...]) -> None:
    assert table_timing(*row)(None, PlanningContext()) is timing_from_table(*row)
