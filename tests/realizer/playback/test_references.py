"""Tests of the references of a block."""

from __future__ import annotations

from dataclasses import replace

from bml_schema import parse
from realizer.playback.references import anticipators_of, external_refs, references, with_references


def test_references_of_attributes_texts_and_constraints_are_found() -> None:
    block = parse(
        """<bml id="b"><head id="h" lexeme="NOD" start="1" stroke="x:y:end"/>
        <speech id="s"><text>a <sync id="m" ref="2"/> b</text></speech>
        <required><constraint><before ref="h:end"><sync ref="3"/></before>
        <synchronize><sync ref="4"/><sync ref="s:start"/></synchronize></constraint></required></bml>"""
    )
    assert sorted(map(str, references(block))) == ["1", "2", "3", "4", "h:end", "s:start", "x:y:end"]


def test_external_refs_are_those_into_other_blocks() -> None:
    block = parse('<bml id="b"><head id="h" lexeme="NOD" start="x:y:end" relax="b:h:stroke + 1"/></bml>')
    assert [str(ref) for ref in external_refs(block)] == ["x:y:end"]


def test_with_references_replaces_every_reference() -> None:
    block = parse(
        """<bml id="b"><head id="h" lexeme="NOD" start="1" stroke="x:y:end"/>
        <speech id="s"><text>a <sync id="m" ref="2"/> b</text></speech>
        <required><constraint><before ref="h:end"><sync ref="3"/></before>
        <synchronize><sync ref="4"/><sync ref="s:start"/></synchronize></constraint></required></bml>"""
    )
    assert with_references(block, lambda ref: ref) == block
    later = with_references(block, lambda ref: replace(ref, offset=ref.offset + 1))
    assert sorted(ref.offset for ref in references(later)) == [1, 1, 1, 2, 3, 4, 5]


def test_anticipators_are_those_that_behaviours_refer_to() -> None:
    tied = '<bml id="a"><wait id="w" start="0" end="anticipators:clock:beat"/></bml>'
    assert anticipators_of(parse(tied)) == {"clock"}
