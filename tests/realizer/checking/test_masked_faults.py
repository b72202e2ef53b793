"""Tests of `realizer.checking.masked_faults`."""

from __future__ import annotations

import pytest

from bml_schema.source import Source
from realizer.checking.document import check_document
from realizer.core.options import PlayOptions
from realizer.playback.player import Player


def faults(text: str) -> list[tuple[str, str, str]]:
    """(type, id, what stands there) of every mark of every fault of a text, in order."""
    source = Source(text)
    found = []
    for part in check_document("x", source, text, Player(PlayOptions(idle=False))):
        for finding in part.findings:
            for spot in sorted(label.spot for label in finding.labels if label.primary):
                what = source.line(spot.line)[spot.column - 1 :][: spot.length]
                found.append((finding.type, finding.id, what))
    return found


@pytest.mark.parametrize(
    ("behaviour", "told"),
    [
        ('<faceLexeme id="f" lexeme="XYZ"\n amount="7"/>', ["XYZ", "7"]),
        ('<faceLexeme id="f" amount = \'a\nb\' lexeme="XYZ"/>', ["a", "XYZ"]),
        ('<head id="f" lexeme="NODD" start="q:end" repetition="0.5"/>', ["NODD", "q", "0.5"]),
        ('<faceLexeme id="f" lexeme="XYZ" start="q:end"/>', ["XYZ", "q"]),
        ('<faceFacs id="f" au="12" side="UP" start="q:end"/>', ["UP", "q"]),
        ('<head id="f" lexeme="NOD" amount="7"/>', ["7"]),
    ],
)
def test_masked_faults_has_faults_behind_those_of_the_parser(behaviour: str, told: list[str]) -> None:
    good = '<head id="n" lexeme="NOD"/>'
    found = faults(f'<bml id="b">\n{good}{behaviour}</bml>')
    assert [what for _, _, what in found] == told
    assert {id for _, id, _ in found} == {"b:f"}


def test_masked_faults_of_several_documents_are_separate() -> None:
    one = '<bml id="{}"><faceLexeme id="f" lexeme="{}" amount="7"/></bml>\n'
    found = faults(
        one.format("a", "XYZ") + "<bml id='broken'><oops" + one.format("c", "SMILE") + one.format("d", "QQQ")
    )
    assert [(id, what) for _, id, what in found if id != "broken"] == [
        ("a:f", "XYZ"),
        ("a:f", "7"),
        ("c:f", "7"),
        ("d:f", "QQQ"),
        ("d:f", "7"),
    ]


def test_masked_faults_report_a_repeated_id_once() -> None:
    found = faults('<bml id="b"><head id="n" lexeme="NOD"/><head id="n" lexeme="NODD"/></bml>')
    assert [what for _, _, what in found] == ["n"]


def test_masked_faults_are_reported_as_if_alone() -> None:
    found = faults('<bml id="b"><faceLexeme id="f" lexeme="XYZ" amount="7"/></bml>')
    assert [type for type, _, _ in found] == ["CANNOT_CREATE_BEHAVIOR", "PARSING_FAILURE"]
