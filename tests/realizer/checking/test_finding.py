"""Tests of the finding value."""

from __future__ import annotations

from bml_schema.source import Spot
from realizer.checking.finding import Finding, Label


def test_a_finding_is_where_its_first_primary_label_is() -> None:
    other, first, second = (Label(Spot(line, 1, 2), primary=line > 1) for line in (1, 2, 3))
    finding = Finding("x", "ADVICE", "a", "", "text", "head", (other, first, second))
    assert finding.spot == Spot(2, 1, 2)


def test_a_finding_without_a_primary_label_is_nowhere() -> None:
    assert Finding("x", "ADVICE", "a", "", "t", "h", (Label(Spot(1, 1, 1), primary=False),)).spot is None
