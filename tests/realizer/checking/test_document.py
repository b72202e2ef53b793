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


@pytest.mark.parametrize(
    ("target", "parameter", "fault"),
    [
        ("a:n", "amount", None),
        ("a:n", "ammount", "paramId: a:n has amount, got 'ammount', did you mean amount?"),
        ("a:m", "amount", "target: wanted a behaviour of a, got a:m"),
        ("c:n", "volume", "paramId: c:n has amount, got 'volume'"),
        ("elsewhere:m", "loudness", None),
    ],
)
def test_check_document_finds_faults_of_changes_of_parameters(target, parameter, fault) -> None:
    change = (
        f'<bmla:parametervaluechange id="p" target="{target}" paramId="{parameter}" start="0.2" '
        'xmlns:bmla="http://www.asap-project.org/bmla"><trajectory type="linear" targetValue="1"/>'
        "</bmla:parametervaluechange>"
    )
    changes = f'<bml id="c"><head id="n" lexeme="NOD"/>{change}</bml>'
    found = [f.text for f in findings(GOOD + changes)]
    assert found == ([] if fault is None else [fault])


def test_check_document_finds_conflicts_of_blocks_that_are_sent_together() -> None:
    text = '<bml id="a"><speech id="s"><text>One.</text></speech></bml>'
    text += '<bml id="b"><speech id="s"><text>Two.</text></speech></bml>'
    (finding,) = findings(text)
    assert finding.id == "b:s"
    assert "wanted the voice" in finding.text
    assert any('composition="APPEND"' in note for note in finding.notes)
    assert not findings(text.replace('"b"', '"b" composition="APPEND"'))


def test_check_document_has_findings_for_each_block() -> None:
    bad = '<bml id="b"><head id="n" lexeme="NIX"/></bml>'
    text = GOOD + "\n" + bad + '\n<bml id="c"><head'
    parts = list(check_document("typed", Source(text), text, Player(PlayOptions(idle=False))))
    assert [part.block.id if part.block else None for part in parts] == ["a", "b", None]
    assert [len(part.findings) for part in parts] == [0, 1, 1]
    assert [f.spot.line for part in parts for f in part.findings if f.spot] == [2, 3]


def test_check_document_lets_blocks_refer_to_earlier_ones() -> None:
    assert not findings(GOOD + '<bml id="b"><head id="m" lexeme="NOD" start="a:n:end"/></bml>')


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
    ("behaviour", "wanted"),
    [
        ('<faceLexeme id="f" lexeme="XYZ"\n amount="7"/>', ["XYZ", "7"]),
        ('<faceLexeme id="f" amount = \'a\nb\' lexeme="XYZ"/>', ["a", "XYZ"]),
        ('<head id="f" lexeme="NODD" start="q:end" repetition="0.5"/>', ["NODD", "q", "0.5"]),
        ('<faceLexeme id="f" lexeme="XYZ" start="q:end"/>', ["XYZ", "q"]),
        ('<faceFacs id="f" au="12" side="UP" start="q:end"/>', ["UP", "q"]),
        ('<head id="f" lexeme="NOD" amount="7"/>', ["7"]),
    ],
)
def test_masked_faults_has_faults_behind_those_of_the_parser(behaviour: str, wanted: list[str]) -> None:
    good = '<head id="n" lexeme="NOD"/>'
    found = faults(f'<bml id="b">\n{good}{behaviour}</bml>')
    assert [what for _, _, what in found] == wanted
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
