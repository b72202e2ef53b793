"""Tests of `realizer.checking.document`."""

from __future__ import annotations

import pytest

from bml_schema.source import Source
from realizer.checking.document import check_document
from realizer.checking.finding import Finding
from realizer.core.options import PlayOptions
from realizer.playback.player import Player

GOOD = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'


def findings(text: str) -> list[Finding]:
    player = Player(PlayOptions(idle=False))
    return [
        finding for part in check_document("typed", Source(text), text, player) for finding in part.findings
    ]


def test_check_document_without_faults_has_no_finding() -> None:
    (part,) = check_document("typed", Source(GOOD), GOOD, Player(PlayOptions(idle=False)))
    assert part.block is not None
    assert part.schedule is not None
    assert part.findings == ()
    assert part.schedule.at("n", "start") == 0


@pytest.mark.parametrize(
    ("text", "marked"),
    [
        ('<bml id="a"><faceLexeme id="f" lexeme="SMIRK"/></bml>', "SMIRK"),
        ('<bml id="a"><head id="n" lexeme="NOD" start="x:end"/></bml>', "x"),
        ('<bml id="a"><head id="n" lexeme="NOD" amount="7"/></bml>', "7"),
        ('<bml id="a"><frown id="n"/></bml>', "frown"),
    ],
)
def test_check_document_marks_a_fault(text: str, marked: str) -> None:
    (finding,) = findings(text)
    assert finding.spot is not None
    line, column, length = finding.spot
    assert (line, text[column - 1 : column - 1 + length]) == (1, marked)


def test_check_document_has_findings_for_each_block() -> None:
    bad = '<bml id="b"><head id="n" lexeme="NIX"/></bml>'
    text = GOOD + "\n" + bad + '\n<bml id="c"><head'
    parts = list(check_document("typed", Source(text), text, Player(PlayOptions(idle=False))))
    assert [part.block.id if part.block else None for part in parts] == ["a", "b", None]
    assert [len(part.findings) for part in parts] == [0, 1, 1]
    assert [f.spot.line for part in parts for f in part.findings if f.spot] == [2, 3]


def test_check_document_lets_blocks_refer_to_earlier_ones() -> None:
    assert not findings(GOOD + '<bml id="b"><head id="m" lexeme="NOD" start="a:n:end"/></bml>')
