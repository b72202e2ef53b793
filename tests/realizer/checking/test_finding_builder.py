"""Tests of `realizer.checking.finding_builder`."""

from __future__ import annotations

from bml_schema.source import Source
from realizer.checking.finding_builder import FindingBuilder

SOURCE = Source('<bml id="a">\n<head id="n"/>\n</bml>\n<bml id="b">\n<head id="n"/>\n</bml>')


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
