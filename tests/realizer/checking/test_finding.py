"""Tests of `realizer.checking.finding`."""

from __future__ import annotations

from bml_schema.source import Source, Spot
from realizer.checking.finding import Finding, FindingBuilder, Label

SOURCE = Source('<bml id="a">\n<head id="n"/>\n</bml>\n<bml id="b">\n<head id="n"/>\n</bml>')


def test_finding_spot_is_that_of_its_first_primary_label() -> None:
    other, first, second = (Label(Spot(line, 1, 2), primary=line > 1) for line in (1, 2, 3))
    finding = Finding("x", "ADVICE", "a", "", "text", "head", (other, first, second))
    assert finding.spot == Spot(2, 1, 2)


def test_finding_spot_without_a_primary_label_is_none() -> None:
    assert Finding("x", "ADVICE", "a", "", "t", "h", (Label(Spot(1, 1, 1), primary=False),)).spot is None


def test_finding_builder_finds_its_element_by_id() -> None:
    for block, line in (("a", 2), ("b", 5)):
        draft = FindingBuilder(SOURCE, f"{block}:n", None, "")
        assert draft.block == block
        assert draft.element is not None
        assert SOURCE.name_spot(draft.element).line == line


def test_finding_builder_finds_its_element_by_path_and_line() -> None:
    draft = FindingBuilder(SOURCE, "b:?", 5, "/bml/head")
    assert draft.element is not None
    assert SOURCE.name_spot(draft.element).line == 5


def test_finding_builder_of_an_unknown_behaviour_has_no_element() -> None:
    assert FindingBuilder(SOURCE, "a:m", None, "").element is None
