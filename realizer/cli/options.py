"""Options that several commands share."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:  # loading them takes longer than `--help` should
    from realizer.behaviours.kind import Position
    from realizer.core.settings import Settings
    from realizer.scheduling.timing import Warning

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


expressions = click.option(
    "--expressions",
    metavar="DIR",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of expressions of your own, a .toml file each; before those that ship.",
)


cooccurrence = click.option(
    "--cooccurrence",
    metavar="on|off|FILE",
    help="Rules of action units that no face shows together: ours, none, a file of them.  [default: on]",
)


prosody = click.option(
    "--prosody",
    type=click.Choice(["on", "off"]),
    help="Small nods, brows, blinks and looks that go with speech; none without idle motion.  [default: on]",
)


deformer = click.option(
    "--deformer",
    type=click.Choice(["mpeg4", "au"]),
    help="What moves the face: FAPs, or its model of action units.  [default: as the face says]",
)


mapping = click.option(
    "--mapping",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="What action units ask of FAPs, as `realizer faces mapping` writes it; before what the face says.",
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
    from realizer.core.settings import Settings, SettingsError

    try:
        return Settings.read(flags)
    except SettingsError as error:
        raise click.UsageError(str(error)) from None


def play_settings(asked: Mapping[str, Any], **flags: Any) -> Settings:
    """Return the settings of playing, and other flags, from the options of a command by their names."""
    from realizer.core.options import PlayOptions

    names = {"voice", *(f.name for f in fields(PlayOptions) if f.name != "idle")}
    flags |= {name: asked[name] for name in names if name in asked}
    return settings(**flags, idle=False if asked["no_idle"] else None)


def playback_options(command: Command) -> Command:
    """--voice, --scene, --media, --expressions and --strict."""
    for option in (
        click.option("--strict", is_flag=True, help="Exit 1 if any behaviour was dropped."),
        expressions,
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
    from realizer.playback.scene_file import parse_scene

    if path is None:
        return None
    try:
        return parse_scene(Path(path).read_text("utf-8"))
    except ValueError as error:
        raise click.UsageError(f"{path}: {error}") from None


def warn_no_voice(voice: str | None) -> None:
    """A word on standard error where nobody asked for silence and there is no voice."""
    from realizer.speech.registry import find_voice, voices

    if voice is None and find_voice(None).name == "silent":
        missing = next((v.description for v in voices() if not v.available), "")
        click.echo(f"realizer: no voice is installed, speech is silent; {missing}", err=True)


def print_warnings(warnings: Iterable[Warning]) -> None:
    """Warnings of documents, one line each, on standard error."""
    for warning in warnings:
        click.echo(f"{warning.id}: {warning.type}: {warning.text}", err=True)


CAMERAS = "front, three-quarter, profile, close, or a camera of the face's own."
LIGHTS = "portrait (soft and warm), daylight (even: shows every feature) or evening (one cheek in shade)"


def light(command: Command) -> Command:
    """--light; another name is refused with the known ones."""
    words = f"{LIGHTS}.  [default: portrait]"
    return click.option("--light", metavar="NAME", callback=_light, help=words)(command)


def _light(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    check_light(value)
    return value


def check_light(name: str | None) -> None:
    """Nothing, where there is such a light; click.BadParameter, which lists them, where there is none."""
    from realizer.render.light import preset

    if name is not None:
        _checked_value(preset, name)


def background(command: Command) -> Command:
    """--background, of pictures that may have no background at all."""
    words = "Behind the head: a colour such as '#d8dde2', or transparent.  [default: the light's own]"
    return click.option("--background", metavar="COLOUR", callback=_background, help=words)(command)


def colour(command: Command) -> Command:
    """--background, of pictures that are opaque."""
    words = "Behind the head: a colour such as '#d8dde2'.  [default: the light's own]"
    return click.option("--background", metavar="COLOUR", callback=_colour, help=words)(command)


def _background(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    from realizer.render.backdrop import colour_of

    return None if value is None else _checked_value(colour_of, value)


def _colour(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value == "transparent":
        raise click.BadParameter("wanted a colour such as #d8dde2: these pictures are opaque")
    return _background(context, parameter, value)


def _checked_value(check: Callable[[str], object], value: str) -> str:
    """The value, where `check` takes it; what it says otherwise is about how it was called."""
    from realizer.core.errors import RenderError

    try:
        check(value)
    except RenderError as error:
        raise click.BadParameter(str(error)) from None
    return value


def check_camera(face: str, name: str) -> None:
    """Nothing, where this face has a camera of that name.

    Raises:
        click.BadParameter: it has none; lists those it has.
    """
    from realizer.face.load import load_face
    from realizer.render.cameras import PRESETS, camera_for

    if name not in PRESETS:  # a face may bring its own
        try:
            _checked_value(lambda name: camera_for(load_face(face), name), name)
        except click.BadParameter as error:
            raise click.BadParameter(error.message, param_hint="--camera") from None


def verbosity(command: click.Command) -> None:
    """Let a command, or each command of a group, take -q and -v as `realizer` itself does."""
    if isinstance(command, click.Group):
        for member in command.commands.values():
            verbosity(member)
        return
    taken = {flag for parameter in command.params for flag in parameter.opts}
    for flags, words in ((("-q", "--quiet"), QUIET), (("-v", "--verbose"), VERBOSE)):
        if not taken & set(flags):
            option = click.Option(
                flags, is_flag=True, expose_value=False, callback=_set_verbosity, help=words
            )
            command.params.append(option)


VERBOSE, QUIET = "Say more on standard error.", "Say nothing but errors on standard error."


def _set_verbosity(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        configure_logging(context, **{str(parameter.name): True})


def configure_logging(context: click.Context, *, quiet: bool = False, verbose: bool = False) -> None:
    """Say as much on standard error as was asked for, before or after the command's name."""
    import logging

    from realizer.core.logs import write_words

    context.obj = {"quiet": quiet, "verbose": verbose}
    level = logging.ERROR if quiet else logging.DEBUG if verbose else logging.WARNING
    write_words(level)
    # Long films say how far they are.
    logging.getLogger("realizer.outputs").setLevel(logging.ERROR if quiet else logging.INFO)


def size(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, int]:
    """512x512 -> (512, 512)."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", value)
    width, height = (int(n) for n in match.groups()) if match else (0, 0)
    if not (16 <= width <= 4096 and 16 <= height <= 4096):
        raise click.BadParameter(f"wanted WIDTHxHEIGHT between 16x16 and 4096x4096, got {value!r}")
    return width, height
