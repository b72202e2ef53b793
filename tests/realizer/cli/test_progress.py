"""Tests of what commands print on standard error."""

from __future__ import annotations

import io
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli, progress
from realizer.server import serve
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.registry import VOICES
from realizer.speech.silent import SilentVoice
from tests.commands import members
from tests.rows import each_row

GOOD = '<bml id="b"><head id="n" lexeme="NOD" start="0.2" end="0.6"/></bml>'


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, list(args), input=GOOD, catch_exceptions=False)


def leaves(command: click.Command) -> list[click.Command]:
    if isinstance(command, click.Group):
        return [leaf for member in members(command).values() for leaf in leaves(member)]
    return [command]


@each_row("command", leaves(cli))
def test_verbosity_is_an_option_of_every_command(command: click.Command) -> None:
    flags = {flag for parameter in command.params for flag in parameter.opts}
    assert {"-q", "--quiet", "-v", "--verbose"} <= flags


@pytest.mark.parametrize(
    "args", [["-q", "realize", "-"], ["realize", "-", "--quiet"], ["realize", "-q", "-"]]
)
def test_verbosity_may_come_before_or_after_the_command(args: list[str], tmp_path: Path) -> None:
    done = run(*args, "--voice", "silent", "-o", str(tmp_path / "x.fap"))
    assert (done.exit_code, done.stderr) == (0, "")


@pytest.fixture
def only_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    for engine in [voice for _, voice in VOICES.working() if voice is not SilentVoice]:
        monkeypatch.setattr(engine, "missing", classmethod(lambda cls, variant=None: f"get {cls.engine}"))


@pytest.mark.parametrize("command", ["serve", "realize", "schedule", "batch"])
def test_warn_no_voice_names_what_to_install_unless_silence_is_asked_for(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, only_silence: None
) -> None:
    monkeypatch.setattr(serve, "run", lambda service: service.close())
    document = tmp_path / "b.bml"
    document.write_text('<bml id="b"><speech id="s"><text>Hello</text></speech></bml>')
    output = ["-o", str(tmp_path / "out"), "--format", "fap", "--workers", "1"] if command == "batch" else []
    names = [] if command == "serve" else [str(document)]
    for asked in ([], ["--voice", "silent"]):
        done = CliRunner().invoke(cli, [command, *names, *output, *asked], catch_exceptions=False)
        assert done.exit_code == 0, done.output
        words = f"no voice is installed, speech is silent; get {EspeakVoice.engine}"
        assert (words in done.stderr) == (not asked)


@pytest.mark.parametrize("command", ["realize", "schedule"])
def test_warn_no_voice_only_where_something_is_said(command: str, only_silence: None) -> None:
    assert "no voice" not in run(command, "-").stderr


class Terminal(io.StringIO):
    """Standard error that is a terminal."""

    def isatty(self) -> bool:
        return True


def context() -> click.Context:
    return click.Context(cli, obj={})


def test_steps_shows_a_bar_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), progress.steps("drawing") as show:
        for done in range(1, 5):
            show(done, 4)
    assert "drawing" in terminal.getvalue()
    assert "100%" in terminal.getvalue()


def test_steps_prints_texts_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    with context(), progress.steps("ada") as show:
        show(0, 2, "paint the skin")
        show(1, 2)
    assert capsys.readouterr().err == "ada: paint the skin ...\n"


def test_waiting_ends_with_its_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with context(), progress.waiting("importing"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), pytest.raises(ValueError, match="bad"), progress.waiting("importing"):
        raise ValueError("bad")
    assert terminal.getvalue().strip() == ""  # the line is cleared


def test_bar_is_hidden_for_fewer_items_than_least(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), progress.bar(range(1), 1, "one", least=2) as items:
        assert list(items) == [0]
    assert "one" not in terminal.getvalue()
    with context(), progress.bar(range(2), 2, "two", least=2) as items:
        assert list(items) == [0, 1]
    assert "two" in terminal.getvalue()


def test_counting_adds_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), progress.counting("judging", 4) as step:
        step(1)
        step(3)
    assert "100%" in terminal.getvalue()
