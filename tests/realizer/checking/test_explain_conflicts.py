"""Tests of `realizer.checking.explain_conflicts`."""

from __future__ import annotations

from bml_schema.source import Source
from realizer.checking.document import check_document
from realizer.checking.finding import Finding
from realizer.playback.player import Player, PlayOptions


def findings(text: str) -> list[Finding]:
    player = Player(PlayOptions(idle=False))
    return [found for part in check_document("typed", Source(text), text, player) for found in part.findings]


def test_explain_conflict_labels_every_line_that_takes_part() -> None:
    text = '<bml id="a">\n<head id="n" lexeme="NOD" start="2"\n end="1"/></bml>'
    (found,) = findings(text)
    spots = [label.spot for label in found.labels]
    marked = {text.splitlines()[s.line - 1][s.column - 1 :][: s.length] for s in spots}
    assert {"2", "1"} <= marked
    assert "cannot" in found.head
