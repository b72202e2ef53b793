"""Tests of `realizer.checking.advice`."""

from __future__ import annotations

import pytest

from bml_schema.source import Source
from realizer.checking.advice import advice
from realizer.checking.document import check_document
from realizer.checking.finding import Finding
from realizer.playback.player import Player, PlayOptions


def advised(text: str) -> list[Finding]:
    player = Player(PlayOptions(idle=False))
    (part,) = check_document("typed", Source(text), text, player)
    assert part.block is not None
    assert part.schedule is not None
    assert part.findings == ()
    return list(advice("typed", Source(text), part.block, part.schedule, player))


def test_advice_is_not_given_on_an_ordinary_block() -> None:
    assert advised('<bml id="a"><head id="n" lexeme="NOD" start="1"/></bml>') == []


@pytest.mark.parametrize(
    ("behaviour", "head", "help"),
    [
        (
            '<head id="n" lexeme="NOD" start="300"/>',
            "start: 300 s are 5 minutes; BML counts in seconds",
            "help: if these are milliseconds, write 0.3",
        ),
        (
            '<wait id="n" duration="7200"/>',
            "duration: 7200 s are 2.0 hours; BML counts in seconds",
            "help: if these are milliseconds, write 7.2",
        ),
        (
            '<faceLexeme id="n" lexeme="SMILE" start="0" end="0.03"/>',
            "lasts 0.03 s from start to end, less than a frame",
            "help: it may not be seen at all; BML counts in seconds",
        ),
    ],
)
def test_advice_is_given_on_times_in_another_unit(behaviour: str, head: str, help: str) -> None:
    (finding,) = advised(f'<bml id="a">{behaviour}</bml>')
    assert (finding.type, finding.id, finding.head) == ("ADVICE", "a:n", head)
    assert finding.notes == (help,)
