"""Tests of `realizer.checking.advice`."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from bml_schema.source import Source
from realizer.checking.advice import advice
from realizer.checking.document import check_document
from realizer.checking.finding import Finding
from realizer.cli import cli
from realizer.playback.player import Player, PlayOptions

HEAD = '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:r="urn:bml-realizer:1" id="b1">\n'


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


def test_advice_on_long_times_is_given_once_for_a_block() -> None:
    nods = "".join(f'<head id="n{k}" lexeme="NOD" start="{k}00"/>' for k in range(1, 9))
    (finding,) = advised(f'<bml id="a">{nods}</bml>')
    assert finding.id == "a:n3"


def test_advice_is_given_on_a_misspelt_child_with_a_prefix() -> None:
    changes = (
        '<bmla:parametervaluechange id="n" target="b:s" paramId="volume" xmlns:bmla="http://www.asap-project.org/bmla">'
        '<bmla:{0} type="linear" targetValue="1"/>{1}</bmla:parametervaluechange>'
    )
    findings = advised(f'<bml id="a">{changes.format("trajectory", "<bmla:trajectori/>")}</bml>')
    (finding,) = [finding for finding in findings if "trajectori" in finding.head]
    assert finding.head == "<bmla:trajectori>: no element of <parametervaluechange>, so it does nothing"
    assert finding.notes == ('help: did you mean "bmla:trajectory"?',)


@pytest.mark.parametrize("element", ["gaze", "gazeShift", "headDirectionShift"])
def test_advice_is_given_on_a_target_without_a_scene(element: str) -> None:
    (finding,) = advised(f'<bml id="a"><{element} id="n" target="person"/></bml>')
    assert finding.head == "target: there is no scene, so 'person' is taken as straight ahead"
    assert advised(f'<bml id="a"><{element} id="n" target="UPLEFT"/></bml>') == []


def check(tmp_path: Path, body: str, *options: str) -> Result:
    document = tmp_path / "d.bml"
    document.write_text(HEAD + body + "\n</bml>", "utf-8")
    return CliRunner().invoke(cli, ["check", str(document), *options], standalone_mode=False)


def test_advice_is_on_standard_error_with_its_place_and_does_not_count(tmp_path: Path) -> None:
    done = check(tmp_path, '<r:expression id="e" name="template:disgust"/>')
    assert (done.return_value, done.stdout) == (0, "")
    assert (
        "d.bml:2:2: ADVICE b1:e: line 2, /bml/expression[1]: disgust stands alone; disgust stands within"
        in done.stderr
    )


def test_advice_finds_a_word_at_the_time_when_it_is_spoken(tmp_path: Path) -> None:
    speech = '<speech id="s" start="2"><text>I say: <sync id="k"/>nonsense.</text></speech>'
    missing = '"nonsense" is said without anger'
    assert missing in check(tmp_path, speech).stderr
    with_anger = speech + '<r:expression id="a" name="template:anger" start="s:k"/>'
    assert missing not in check(tmp_path, with_anger).stderr
    too_early = speech + '<r:expression id="a" name="template:anger" start="0"/>'
    assert missing in check(tmp_path, too_early).stderr


def test_advice_depends_on_the_role(tmp_path: Path) -> None:
    body = '<r:expression id="e" name="template:happiness"/>'
    assert "a listener shows happiness" in check(tmp_path, body, "--role", "listener").stderr
    assert "a listener" not in check(tmp_path, body).stderr


def test_advice_ignores_faces_that_are_not_templates(tmp_path: Path) -> None:
    done = check(tmp_path, '<faceLexeme id="e" lexeme="RAISE_BROWS" start="0" end="60"/>')
    assert "ADVICE" not in done.stderr
