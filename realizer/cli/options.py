"""Arguments that several commands share."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:  # loading them takes longer than `--help` should
    from realizer.behaviours.kind import Position
    from realizer.scheduling.timing import Warning
    from realizer.settings import Settings

__all__: list[str] = []

Command = TypeVar("Command", bound=Callable[..., Any])

documents = click.argument(
    "documents", nargs=-1, required=True, metavar="DOC...", type=click.Path(allow_dash=True)
)


media = click.option(
    "--media",
    metavar="DIR",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of the files that documents may name.",
)


class Number(click.FloatRange):
    """A finite number in a range; click lets NaN through."""

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, parameter, context)
        if not math.isfinite(number):
            self.fail(f"wanted a finite number, got {value}", parameter, context)
        return number


def settings(**flags: Any) -> Settings:
    """What flags, REALIZER_* variables and defaults say together.

    Raises:
        click.UsageError: a wrong value, and where it came from.
    """
    from realizer.settings import Settings, SettingsError

    try:
        return Settings.read(flags)
    except SettingsError as error:
        raise click.UsageError(str(error)) from None


def playing(command: Command) -> Command:
    """--voice, --scene, --media and --strict."""
    for option in (
        click.option("--strict", is_flag=True, help="Exit 1 if any behaviour was dropped."),
        media,
        click.option(
            "--scene", type=click.Path(exists=True, dir_okay=False), help="File of targets: name x y z."
        ),
        click.option("--voice", metavar="NAME", help="A voice of `realizer voices`."),
    ):
        command = option(command)
    return command


def read_documents(names: Iterable[str]) -> list[bytes]:
    """The bytes of every document; `-` is standard input.

    Raises:
        click.UsageError: a file that cannot be read.
    """
    texts = []
    for name in names:
        try:
            texts.append(sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes())
        except OSError as error:
            raise click.UsageError(f"{name}: {error.strerror}") from None
    return texts


def read_scene(path: str | Path | None) -> dict[str, Position] | None:
    from realizer.pipeline import parse_scene

    if path is None:
        return None
    try:
        return parse_scene(Path(path).read_text("utf-8"))
    except ValueError as error:
        raise click.UsageError(f"{path}: {error}") from None


def tell_silence(voice: str | None) -> None:
    """A word on standard error where nobody asked for silence and there is no voice."""
    from realizer.speech import find_voice, voices

    if voice is None and find_voice(None).name == "silent":
        missing = next((v.says for v in voices() if not v.available), "")
        click.echo(f"realizer: no voice is installed, speech is silent; {missing}", err=True)


def tell(warnings: Iterable[Warning]) -> None:
    """Warnings of documents, one line each, on standard error."""
    for warning in warnings:
        click.echo(f"{warning.id}: {warning.type}: {warning.text}", err=True)


def size(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, int]:
    """512x512 -> (512, 512)."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", value)
    width, height = (int(n) for n in match.groups()) if match else (0, 0)
    if not (16 <= width <= 4096 and 16 <= height <= 4096):
        raise click.BadParameter(f"wanted WIDTHxHEIGHT between 16x16 and 4096x4096, got {value!r}")
    return width, height
