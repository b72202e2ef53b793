"""Tests of `realizer.checking.explain`."""

from __future__ import annotations

import pytest

from bml_schema.source import Source
from realizer.checking.document import check_document
from realizer.checking.explain import attributes_of, near
from realizer.checking.finding import Finding
from realizer.playback.player import Player, PlayOptions


def finding(behaviours: str) -> Finding:
    text = f'<bml id="a">{behaviours}</bml>'
    (part,) = check_document("typed", Source(text), text, Player(PlayOptions(idle=False)))
    (found,) = part.findings
    return found


@pytest.mark.parametrize(
    ("behaviours", "note"),
    [
        ('<faceLexeme id="f" lexeme="SMIL"/>', "did you mean"),
        ('<head id="n" lexeme="NOD" start="m:end"/><head id="k" lexeme="SHAKE"/>', "help: there is k"),
        ('<head id="n" lexeme="NOD" start="k:peak"/><head id="k" lexeme="SHAKE"/>', "help: k has start, "),
        ('<heed id="n" lexeme="NOD"/>', "head"),
    ],
)
def test_finding_of_suggests_what_was_meant(behaviours: str, note: str) -> None:
    assert any(note in one for one in finding(behaviours).notes)


def test_finding_of_a_taken_id_marks_its_first_use() -> None:
    found = finding('<head id="n" lexeme="NOD"/>\n<head id="n" lexeme="SHAKE"/>')
    assert [(label.spot.line, label.primary) for label in found.labels] == [(2, True), (1, False)]


def test_near_ignores_case() -> None:
    assert near("smlie", ["SMILE", "FROWN"]) == "SMILE"
    assert near("xyz", ["SMILE", "FROWN"]) is None


def test_attributes_of_a_warning_are_those_it_mentions() -> None:
    assert attributes_of("start, end: wanted one; amount: wanted 0..1, got 7") == ["start", "end", "amount"]
    assert attributes_of("amount: wanted 0..1, got 7; with it went b") == ["amount"]
    assert attributes_of("something else") == []
