"""Tests of the options that several commands share."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner, Result

from realizer.cli import cli
from realizer.cli.options import parse_size
from tests.commands import members

CONTEXT, OPTION = click.Context(cli), click.Option(["--size"])
GOOD = '<bml id="b"><head id="n" lexeme="NOD" start="0.2" end="0.6"/></bml>'


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, list(args), input=GOOD, catch_exceptions=False)


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


@pytest.mark.gl
@pytest.mark.long
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
        ("faces sheet be", "ben"),
        ("faces check ada be", "ben"),
    ],
)
def test_options_complete_their_values(words: str, found: str) -> None:
    *before, typed = words.split()
    completion = ShellComplete(cli, {}, "realizer", "_REALIZER_COMPLETE")
    assert found in [item.value for item in completion.get_completions(before, typed)]


def test_every_option_has_a_long_name() -> None:
    def nameless(command: click.Command, path: str) -> list[str]:
        found = [
            f"{path} {option.opts}"
            for option in command.params
            if isinstance(option, click.Option) and not any(name.startswith("--") for name in option.opts)
        ]
        nested = members(command).items() if isinstance(command, click.Group) else ()
        return found + [row for name, each in nested for row in nameless(each, f"{path} {name}")]

    assert nameless(cli, "realizer") == []
