"""Tests of `realizer.checking.finding`."""

from __future__ import annotations

from bml_schema.source import Spot
from realizer.checking.finding import Finding, Label


def test_finding_spot_is_that_of_its_first_primary_label() -> None:
    other, first, second = (Label(Spot(line, 1, 2), primary=line > 1) for line in (1, 2, 3))
    finding = Finding("x", "ADVICE", "a", "", "text", "head", (other, first, second))
    assert finding.spot == Spot(2, 1, 2)


def test_finding_spot_without_a_primary_label_is_none() -> None:
    assert Finding("x", "ADVICE", "a", "", "t", "h", (Label(Spot(1, 1, 1), primary=False),)).spot is None
