"""Tests of the options that several commands share."""

from __future__ import annotations

import io
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner, Result

from realizer.cli import cli, options
from realizer.cli.options import parse_size
from realizer.server import serve
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.registry import VOICES
from realizer.speech.silent import SilentVoice
from tests.commands import run as run_command
from tests.rows import each_row

CONTEXT, OPTION = click.Context(cli), click.Option(["--size"])
GOOD = '<bml id="b"><head id="n" lexeme="NOD" start="0.2" end="0.6"/></bml>'


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, list(args), input=GOOD, catch_exceptions=False)


def leaves(command: click.Command) -> list[click.Command]:
    if isinstance(command, click.Group):
        return [leaf for member in command.commands.values() for leaf in leaves(member)]
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


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (
            ["-o", "x.png", "--camera", "top"],
            "camera: wanted one of front, three-quarter, profile, close, got",
        ),
        (
            ["-o", "x.png", "--light", "noon"],
            "light: wanted one of portrait, daylight, evening, studio, outdoors, got 'noon'",
        ),
        (["-o", "x.png", "--background", "#12"], "got '#12', which is no file"),
        (["-o", "x.png", "--background", __file__], "background: wanted a picture (PNG, JPEG, WEBP), got"),
        (["-o", "x.mp4", "--background", "transparent"], "a .png with a time, can be transparent"),
    ],
)
def test_realize_refuses_an_unknown_camera_light_or_background(args: list[str], words: str) -> None:
    done = run("realize", "-", *args)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--camera", "top"], "wanted one of front, three-quarter, profile, close, got 'top'"),
        (["--light", "noon"], "wanted one of portrait, daylight, evening, studio, outdoors, got 'noon'"),
        (["--background", "transparent"], "these pictures are opaque"),
        (["--background", "beach.png"], "got 'beach.png', which is no file"),
    ],
)
def test_serve_refuses_an_unknown_camera_light_or_background(args: list[str], words: str) -> None:
    done = run("serve", "--port", "0", *args)
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())


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


@pytest.mark.gl
@pytest.mark.slow
def test_light_and_background_are_visible_in_the_picture(tmp_path: Path) -> None:
    from PIL import Image

    def picture(*args: str) -> Image.Image:
        path = tmp_path / "x.png"
        done = run("realize", "-", "-o", str(path), "--at", "0", "--size", "64x64", "--no-idle", *args)
        assert done.exit_code == 0
        return Image.open(path).copy()

    usual = picture("--background", "#204060")
    evening = picture("--light", "evening", "--background", "transparent")
    assert sum(usual.getpixel((32, 30))) > sum(evening.getpixel((40, 30))[:3])
    assert usual.getpixel((1, 1)) == (0x20, 0x40, 0x60)
    assert evening.getpixel((1, 1))[3] == 0


@pytest.mark.parametrize("text", ["16x4096", "4096x16", "512x384"])
def test_parse_size_accepts_16_to_4096_pixels(text: str) -> None:
    assert "x".join(map(str, parse_size(CONTEXT, OPTION, text))) == text


@pytest.mark.parametrize("text", ["15x64", "64x15", "4097x64", "64x4097", "64", "64x", "-64x64"])
def test_parse_size_refuses_others(text: str) -> None:
    with pytest.raises(click.BadParameter, match="between 16x16 and 4096x4096"):
        parse_size(CONTEXT, OPTION, text)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("realize --face a", "ada"),
        ("realize --voice si", "silent"),
        ("realize --camera pro", "profile"),
        ("serve --light eve", "evening"),
        ("batch --format arkit", "arkit.csv"),
        ("enrich --mood hopef", "hopeful"),
        ("emotion gui", "guilty"),
    ],
)
def test_options_complete_their_values(words: str, found: str) -> None:
    *before, typed = words.split()
    completion = ShellComplete(cli, {}, "realizer", "_REALIZER_COMPLETE")
    assert found in [item.value for item in completion.get_completions(before, typed)]


class Terminal(io.StringIO):
    """Standard error of somebody who looks at it."""

    def isatty(self) -> bool:
        return True


def context() -> click.Context:
    return click.Context(cli, obj={})


def test_steps_shows_a_bar_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), options.steps("drawing") as show:
        for done in range(1, 5):
            show(done, 4)
    assert "drawing" in terminal.getvalue()
    assert "100%" in terminal.getvalue()


def test_steps_prints_texts_elsewhere(capsys: pytest.CaptureFixture[str]) -> None:
    with context(), options.steps("ada") as show:
        show(0, 2, "paint the skin")
        show(1, 2)
    assert capsys.readouterr().err == "ada: paint the skin ...\n"


def test_waiting_ends_with_its_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with context(), options.waiting("importing"):
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with context(), pytest.raises(ValueError, match="bad"), options.waiting("importing"):
        raise ValueError("bad")
    assert terminal.getvalue().strip() == ""  # the line is cleared


def test_every_option_has_a_long_name() -> None:
    def nameless(command: click.Command, path: str) -> list[str]:
        found = [
            f"{path} {option.opts}"
            for option in command.params
            if isinstance(option, click.Option) and not any(name.startswith("--") for name in option.opts)
        ]
        nested = command.commands.items() if isinstance(command, click.Group) else ()
        return found + [row for name, each in nested for row in nameless(each, f"{path} {name}")]

    assert nameless(cli, "realizer") == []


@pytest.mark.parametrize(
    ("command", "status"),
    [
        (["faces", "check", "adda"], 2),
        (["faces", "sheet", "adda", "-o", "x.png"], 2),
        (["align", "{file}", "words"], 1),
    ],
)
def test_commands_exit_with_one_prefix_and_the_status_of_the_fault(
    command: list[str], status: int, tmp_path: Path
) -> None:
    (file := tmp_path / "hi.bml").write_text("<bml/>")
    done = run_command(*(word.format(file=file) for word in command))
    assert (done.returncode, done.stderr.startswith("realizer: ")) == (status, True)
