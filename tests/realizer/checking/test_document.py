"""A document in, all of its faults out, block by block; how they are told is tested with the command."""

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


def test_a_sound_document_is_read_and_scheduled_without_a_finding() -> None:
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
def test_a_fault_is_marked_where_it_is(text: str, marked: str) -> None:
    (finding,) = findings(text)
    assert finding.spot is not None
    line, column, length = finding.spot
    assert (line, text[column - 1 : column - 1 + length]) == (1, marked)


def test_every_block_of_a_text_has_its_own_findings() -> None:
    bad = '<bml id="b"><head id="n" lexeme="NIX"/></bml>'
    text = GOOD + "\n" + bad + '\n<bml id="c"><head'
    parts = list(check_document("typed", Source(text), text, Player(PlayOptions(idle=False))))
    assert [part.block.id if part.block else None for part in parts] == ["a", "b", None]
    assert [len(part.findings) for part in parts] == [0, 1, 1]
    assert [f.spot.line for part in parts for f in part.findings if f.spot] == [2, 3]


def test_a_later_block_may_refer_to_an_earlier_one() -> None:
    assert not findings(GOOD + '<bml id="b"><head id="m" lexeme="NOD" start="a:n:end"/></bml>')
