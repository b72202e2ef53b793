"""Tests of `realizer.checking.explain_conflicts`."""

from __future__ import annotations

import pytest

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


@pytest.mark.parametrize(
    ("line", "marked", "path"),
    [
        ('<head id="n" lexeme="NOD" start="m:nope"/>', "nope", "/bml/head[2]"),
        ('<head id="n" lexeme="NOD" start="b:m:end"/>', "b:m:end", "/bml/head[2]"),
        (
            '<constraint id="c"><synchronize ref="m:nope"><sync ref="m:end"/></synchronize></constraint>',
            "nope",
            "/bml/constraint[1]/synchronize[1]",
        ),
    ],
)
def test_explain_conflict_marks_a_reference_to_an_unknown_point(line: str, marked: str, path: str) -> None:
    (found,) = findings(f'<bml id="a"><head id="m" lexeme="NOD"/>\n{line}</bml>')
    (label,) = found.labels
    assert label.spot.line == 2
    assert line[label.spot.column - 1 :][: label.spot.length] == marked
    assert found.path == path
