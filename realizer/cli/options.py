"""Options and helpers that several commands share."""

from __future__ import annotations

import errno
import math
import re
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:  # importing them takes longer than `--help` should
    from realizer.behaviours.kind import Position
    from realizer.core.settings import Settings
    from realizer.playback.player import Player
    from realizer.scheduling.timing import Warning

Command = TypeVar("Command", bound=Callable[..., Any])

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)


class MappingFile(click.Path):
    """A file that maps action units to FAPs, or the name of a published mapping."""

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        from realizer.tables.mappings import published_file

        return super().convert(published_file(str(value)) or value, parameter, context)


FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
OUTPUT = click.Path(path_type=Path)
CAMERAS = "front, three-quarter, profile, close, or a camera of the face's own."
QUIET, VERBOSE = "Print only errors on standard error.", "Print more on standard error."
DISK_FULL = (errno.ENOSPC, errno.EFBIG)

documents = click.argument(
    "documents", nargs=-1, required=True, metavar="DOC|TEXT...", type=click.Path(allow_dash=True)
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print JSON.")
media = click.option(
    "--media", metavar="DIR", type=FOLDER, help="Folder of the files that documents may refer to."
)
expressions = click.option(
    "--expressions",
    metavar="DIR",
    type=FOLDER,
    help="Folder of your own expressions, one .toml file each; they override built-in ones.",
)
scene = click.option(
    "--scene", type=FILE, help="File of gaze and pointing targets, one a line: NAME X Y Z, in metres."
)


def completing(names: Callable[[], Iterable[str]]) -> Callable[..., list[str]]:
    """Return the completion of a shell for names that begin with what was typed."""
    return lambda context, parameter, typed: [name for name in names() if name.startswith(typed)]


def _faces() -> Iterable[str]:
    from realizer.face.load import face_folders

    return face_folders()


def _voices() -> Iterable[str]:
    from realizer.speech.registry import VOICES

    return VOICES


def cameras() -> Iterable[str]:
    from realizer.render.cameras import PRESETS

    return PRESETS


def _lights() -> Iterable[str]:
    from realizer.render.light import presets

    return presets()


def check_face(name: str | None) -> str | None:
    """Return a face that is there, by name or path.

    Raises:
        click.BadParameter: it is not; the text lists those that are.
    """
    from realizer.core.errors import UnknownFaceError
    from realizer.face.load import folder_of

    with reporting(UnknownFaceError, wrong=bad("--face")):
        try:
            folder_of("default" if name is None else name)
        except FileNotFoundError as error:
            raise click.BadParameter(f"{error.filename}: {error.strerror}", param_hint="--face") from None
    return name


def face(what: str, **attributes: Any) -> Callable[[Command], Command]:
    """Return the option --face; `what` says what the face is for."""
    return click.option(
        "--face",
        metavar="NAME|PATH",
        callback=lambda context, parameter, value: check_face(value),
        shell_complete=completing(_faces),
        help=f"{what}: a name of `realizer faces list`, a face folder, or a GLB head.",
        **attributes,
    )


voice = click.option(
    "--voice",
    metavar="NAME",
    shell_complete=completing(_voices),
    help="Voice to speak with; see `realizer voices`.",
)
cooccurrence = click.option(
    "--cooccurrence",
    metavar="on|off|FILE",
    help="Rules for action units that no face shows together: the built-in ones, none, or a file.  "
    "[default: on]",
)
prosody = click.option(
    "--prosody",
    type=click.Choice(["on", "off"]),
    help="Small nods, raised brows, blinks and glances that accompany speech; off with --no-idle.  "
    "[default: on]",
)


def _style(name: str) -> Callable[[Command], Command]:
    return click.option(
        f"--{name}",
        metavar="0..2",
        type=click.FloatRange(0, 2),
        help=f"How far the {name} move{'s' * (name == 'jaw')} in speech: 0 mumbles, 2 over-articulates.  "
        "[default: 1]",
    )


jaw, lips = _style("jaw"), _style("lips")
deformer = click.option(
    "--deformer",
    type=click.Choice(["mpeg4", "au"]),
    help="Move the face by FAPs (mpeg4) or by its action unit model (au).  [default: the face's own choice]",
)
mapping = click.option(
    "--mapping",
    metavar="FILE|zhang|raouzaiou",
    type=MappingFile(exists=True, dir_okay=False, path_type=Path),
    help="Mapping of action units to FAPs, as `realizer faces mapping` writes it, or a published one, that "
    "overrides the face's.",
)


class ProfileSet(click.ParamType):  # type: ignore[type-arg]
    """The name of a set of emotion profiles, or a profile file."""

    name = "SET|FILE.txt"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> str:
        from realizer.emotions.archetypes import archetypes

        try:
            archetypes(value)
        except ValueError as error:
            self.fail(str(error).removeprefix("profiles: "), parameter, context)
        return str(value)


class Number(click.FloatRange):
    """A finite number in a range; click accepts NaN."""

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, parameter, context)
        if not math.isfinite(number):
            self.fail(f"wanted a finite number, got {value}", parameter, context)
        return number


def parse_size(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, int]:
    """512x512 -> (512, 512)."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", value)
    sides = [int(n) for n in match.groups()] if match else []
    if not sides or not all(16 <= side <= 4096 for side in sides):
        raise click.BadParameter(f"wanted WIDTHxHEIGHT between 16x16 and 4096x4096, got {value!r}")
    width, height = sides
    return width, height


fps = click.option("--fps", type=Number(0, 240, min_open=True), help="Frames per second.  [default: 25]")
liveliness = click.option(
    "--liveliness",
    metavar="0..1",
    type=Number(0, 1),
    help="How much an idle face breathes, changes its posture and varies its blinks; 0 with --no-idle.  "
    "[default: 1]",
)
size = click.option(
    "--size",
    metavar="WxH",
    default="512x512",
    show_default=True,
    callback=parse_size,
    help="Size of pictures in pixels.",
)
camera = click.option(
    "--camera", default="front", show_default=True, shell_complete=completing(cameras), help=CAMERAS
)
at = click.option(
    "--at", type=Number(0), metavar="SECONDS", help="With .png: draw this instant instead of a contact sheet."
)


def settings(**flags: Any) -> Settings:
    """Return the settings from flags, REALIZER_* variables and defaults.

    Raises:
        click.UsageError: a wrong value; the text says where it came from.
    """
    from realizer.core.settings import Settings, SettingsError

    with reporting(SettingsError):
        return Settings.read(flags)


def play_settings(options: Mapping[str, Any], **flags: Any) -> Settings:
    """Return the settings for playing from the options of a command and further flags."""
    from realizer.core.options import PlayOptions

    names = {"voice", *(f.name for f in fields(PlayOptions) if f.name != "idle")}
    flags |= {name: options[name] for name in names if name in options}
    return settings(**flags, idle=False if options["no_idle"] else None)


def several(*options: Callable[[Any], Any]) -> Callable[[Command], Command]:
    """Return a decorator that adds these options to a command."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


strict_bml = click.option(
    "--strict-bml/--lenient-bml",
    default=None,
    help="Read documents as BML 1.0 only, or also as its drafts and the dialects of other realizers.  "
    "[default: --lenient-bml]",
)
strict = click.option("--strict", is_flag=True, help="Exit with 1 if any behaviour was dropped.")
playback_options = several(voice, scene, media, expressions, strict_bml, strict)


def planning_player(chosen: Settings, scene: Path | None) -> Player:
    """Return a player for schedules only, with the targets of a scene file."""
    from realizer.core.options import PlayOptions
    from realizer.playback.player import Player

    names = ("language", "media", "expressions", "strict_bml")
    values = {name: getattr(chosen, name) for name in names}
    return Player(PlayOptions(scene=read_scene(scene), **values))


def read_documents(names: Iterable[str]) -> list[str | bytes]:
    """Return every document: `-` is standard input, and a text that names no file is spoken.

    Raises:
        click.UsageError: a file cannot be read.
    """
    from realizer.sources import document_of

    texts: list[str | bytes] = []
    for number, name in enumerate(names, 1):
        try:
            texts.append(sys.stdin.buffer.read() if name == "-" else document_of(name, number).bml)
        except OSError as error:
            raise click.UsageError(f"{name}: {error.strerror}") from None
        except ValueError as error:
            raise click.UsageError(f"{name!r}: {error}") from None
    return texts


def read_file(name: str) -> bytes:
    """Return the content of a file; `-` is standard input.

    Raises:
        click.UsageError: it cannot be read.
    """
    try:
        return sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    except OSError as error:
        raise click.UsageError(f"{name}: {error.strerror}") from None


def decode(content: bytes, name: str, wanted: str) -> str:
    """Return the text of a UTF-8 file.

    Args:
        content: its bytes.
        name: the file, or `-` for standard input; wanted: what it should be; both for messages.

    Raises:
        click.UsageError: it is not UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"0x{content[error.start]:02X} at {error.start}"
        source = "standard input" if name == "-" else name
        raise click.UsageError(f"{source}: wanted {wanted} in UTF-8, got byte {byte}") from None


def read_scene(path: str | Path | None) -> dict[str, Position] | None:
    """Return the targets of a scene file, or None without one."""
    from realizer.behaviours.gaze_targets import parse_scene

    if path is None:
        return None
    with reporting(ValueError, f"{path}: "):
        return parse_scene(Path(path).read_text("utf-8"))


def check_suffix(path: Path | None, *suffixes: str) -> None:
    """Refuse a path that ends in none of the suffixes, in either case."""
    if path is not None and path.suffix.lower() not in suffixes:
        raise click.UsageError(f"{path}: wanted a name that ends in {' or '.join(suffixes)}")


@contextmanager
def reporting(
    kind: type[Exception], prefix: str = "", wrong: Callable[[str], click.ClickException] = click.UsageError
) -> Iterator[None]:
    """Report errors of a kind to the user, by default as wrong usage."""
    try:
        yield
    except kind as error:
        raise wrong(f"{prefix}{error}") from None


def bad(option: str | None) -> Callable[[str], click.BadParameter]:
    """Return the error class for wrong values of an option; None for the option that is being parsed."""
    return partial(click.BadParameter, param_hint=option)


@contextmanager
def writing(path: str | Path) -> Iterator[None]:
    """Report that `path` cannot be written as wrong usage; a full disk is not the user's mistake."""
    try:
        yield
    except OSError as error:
        if error.errno in DISK_FULL:
            raise
        raise click.UsageError(f"{path}: {error.strerror or error}") from None


def is_quiet() -> bool:
    """Return whether --quiet is in effect."""
    return bool((click.get_current_context().obj or {}).get("quiet"))


def note(text: str) -> None:
    """Print a line on standard error, unless --quiet is in effect."""
    if not is_quiet():
        click.echo(text, err=True)


def progress(pictures: Iterable[Any], label: str, count: int) -> Any:
    """Return a context of the same pictures that shows a bar on standard error; 0 is an unknown number."""
    hidden = is_quiet() or count == 1
    return click.progressbar(pictures, length=count or None, label=label, file=sys.stderr, hidden=hidden)


@contextmanager
def steps(label: str) -> Iterator[Callable[..., None]]:
    """Give a function (done, count, text="") that shows how much of a work is done.

    On a terminal it shows a bar; elsewhere the texts are printed, a line each.
    """
    with ExitStack() as stack:
        bar: Any = None

        def show(done: int, count: int, text: str = "") -> None:
            nonlocal bar
            if not sys.stderr.isatty():
                if text:
                    note(f"{label}: {text} ...")
                return
            if bar is None:
                hidden = is_quiet() or count == 1
                bar = stack.enter_context(
                    click.progressbar(
                        length=count,
                        label=label,
                        file=sys.stderr,
                        hidden=hidden,
                        item_show_func=lambda item: item or "",
                    )
                )
            bar.update(done - bar.pos, text)

        yield show


@contextmanager
def waiting(label: str) -> Iterator[None]:
    """Show on a terminal for how many seconds a work lasts that has no steps to count."""
    over, began = threading.Event(), time.monotonic()

    def show() -> None:
        while not over.wait(1.0):
            click.echo(f"\r{label}: {time.monotonic() - began:.0f} s", nl=False, err=True)
        click.echo("\r" + " " * (len(label) + 10) + "\r", nl=False, err=True)

    thread = threading.Thread(target=show, daemon=True)
    shown = sys.stderr.isatty() and not is_quiet()
    if shown:
        thread.start()
    try:
        yield
    finally:
        over.set()
        if shown:
            thread.join()


def warn_no_voice(voice: str | None) -> None:
    """Print a warning if no voice was requested and only the silent one is installed."""
    from realizer.speech.registry import find_voice, voices

    if voice is None and find_voice(None).name == "silent":
        missing = next((v.description for v in voices() if not v.available), "")
        click.echo(f"realizer: no voice is installed, speech is silent; {missing}", err=True)


def print_warnings(warnings: Iterable[Warning]) -> None:
    """Print warnings about documents on standard error, one line each."""
    for warning in warnings:
        click.echo(f"{warning.id}: {warning.type}: {warning.text}", err=True)


def check_light(name: str | None) -> str | None:
    """Return the name of a light.

    Raises:
        click.BadParameter: there is no such light; the text lists them.
    """
    from realizer.render.light import preset

    return _checked(preset, name)


def check_camera(face: str, name: str) -> None:
    """Check that a face has a camera of this name.

    Raises:
        click.BadParameter: it has none; the text lists those it has.
    """
    from realizer.face.load import load_face
    from realizer.render.cameras import PRESETS, camera_for

    if name not in PRESETS:  # a face may bring its own
        _checked(lambda name: camera_for(load_face(face), name), name, "--camera")


def _background(value: str | None) -> str | None:
    from realizer.render.backdrop import background_of, is_picture, read_picture

    _checked(background_of, value)
    return _checked(read_picture, value) if is_picture(value) else value


def _opaque(value: str | None) -> str | None:
    if value == "transparent":
        raise click.BadParameter("wanted a colour such as #d8dde2, or a picture: these pictures are opaque")
    return _background(value)


def _checked(check: Callable[[str], object], value: str | None, option: str | None = None) -> str | None:
    """Return the value; raises BadParameter with the text of a RenderError of `check`."""
    from realizer.core.errors import RenderError

    with reporting(RenderError, wrong=bad(option)):
        if value is not None:
            check(value)
    return value


light = click.option(
    "--light",
    metavar="NAME",
    shell_complete=completing(_lights),
    callback=lambda context, parameter, value: check_light(value),
    help="portrait (soft and warm), daylight (even, shows every feature), evening (one cheek in shade), "
    "studio (neutral, from both sides) or outdoors (low sun).  [default: portrait]",
)
background = click.option(
    "--background",
    metavar="COLOUR|FILE",
    callback=lambda context, parameter, value: _background(value),
    help="What is behind the head: a colour such as '#d8dde2', a picture (PNG, JPEG, WebP), or transparent.  "
    "[default: the light's own]",
)
opaque_background = click.option(
    "--background",
    metavar="COLOUR|FILE",
    callback=lambda context, parameter, value: _opaque(value),
    help="What is behind the head: a colour such as '#d8dde2', or a picture (PNG, JPEG, WebP).  "
    "[default: the light's own]",
)


def verbosity(command: click.Command) -> None:
    """Add -q and -v to a command, or to each command of a group, as `realizer` itself has them."""
    if isinstance(command, click.Group):
        for member in command.commands.values():
            verbosity(member)
        return
    for flags, words in ((("-q", "--quiet"), QUIET), (("-v", "--verbose"), VERBOSE)):
        option = click.Option(flags, is_flag=True, expose_value=False, callback=_set_verbosity, help=words)
        command.params.append(option)


def _set_verbosity(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        configure_logging(context, **{str(parameter.name): True})


def configure_logging(context: click.Context, *, quiet: bool = False, verbose: bool = False) -> None:
    """Set how much is logged to standard error; -q and -v come before or after the command's name."""
    import logging

    from realizer.core.logs import write_words

    context.obj = {"quiet": quiet, "verbose": verbose}
    write_words(logging.ERROR if quiet else logging.DEBUG if verbose else logging.WARNING)
    # Writing a long film reports its progress.
    logging.getLogger("realizer.outputs").setLevel(logging.ERROR if quiet else logging.INFO)
