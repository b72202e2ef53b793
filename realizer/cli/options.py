"""Options that several commands share, and the types of their values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import click

from realizer.cli.inputs import bad, reporting
from realizer.core.errors import FaceError, RenderError

Decorator = Callable[[Any], Any]

FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
OUTPUT = click.Path(path_type=Path)
CAMERAS = "front, three-quarter, profile, close, or a camera of the face's own."


def option(words: str, help: str | None = None, type: Any = None, **attributes: Any) -> Decorator:
    """Return an option, written as its help shows it, such as "-o --output FILE"; a default is shown.

    Args:
        words: its names, which begin with "-", and what stands for its value.
        name: the parameter of the command; None: as its long name; others: as `click.option`.
    """
    parts = words.split(" ")
    count = sum(part.startswith("-") for part in parts)
    name = attributes.pop("name", None)
    if attributes.get("default") is not None:
        attributes.setdefault("show_default", True)
    metavar = " ".join(parts[count:]) or None
    names = (*parts[:count], name) if name else parts[:count]
    return click.option(*names, help=help, type=type, metavar=metavar, **attributes)


def several(*options: Decorator) -> Decorator:
    """Return a decorator that adds these options to a command."""

    def add(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def completing(source: str, attribute: str = "") -> Callable[..., list[str]]:
    """Return the completion of a shell for names, without a dot, that begin with what was typed.

    Args:
        source: "module:object" of the names, or of a function that returns them.
        attribute: of that object, which has the names.
    """

    def complete(context: click.Context, parameter: click.Parameter, typed: str) -> list[str]:
        found = resolve_name(source)
        found = found() if callable(found) else found
        names = (name.removeprefix(".") for name in (getattr(found, attribute) if attribute else found))
        return [name for name in names if name.startswith(typed)]

    return complete


class MappingFile(click.Path):
    """A file that maps action units to FAPs, or the name of a published mapping."""

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        from realizer.tables.mappings import published_file

        return super().convert(published_file(str(value)) or value, parameter, context)


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
    width, height = map(int, match.groups()) if match else (0, 0)
    if not (16 <= width <= 4096 and 16 <= height <= 4096):
        raise click.BadParameter(f"wanted WIDTHxHEIGHT between 16x16 and 4096x4096, got {value!r}")
    return width, height


def check_face(name: str | None) -> str | None:
    """Return a face that is there, by name or path; the error lists those that are."""
    from realizer.face.load import folder_of

    with reporting(FaceError, wrong=bad("--face")):
        try:
            folder_of("default" if name is None else name)
        except FileNotFoundError as error:
            raise bad("--face")(f"{error.filename}: {error.strerror}") from None
    return name


def check_light(name: str | None) -> str | None:
    """Return the name of a light; the error lists those that are there."""
    from realizer.render.light import preset

    with reporting(RenderError, wrong=click.BadParameter):
        if name is not None:
            preset(name)
    return name


def check_camera(face: str, name: str) -> None:
    """Check that a face has a camera of this name; the error lists those it has."""
    from realizer.face.load import load_face
    from realizer.render.cameras import PRESETS, camera_for

    with reporting(RenderError, wrong=bad("--camera")):
        if name not in PRESETS:  # a face may bring its own
            camera_for(load_face(face), name)


def _background(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    from realizer.render.backdrop import background_of, is_picture, read_picture

    with reporting(RenderError, wrong=click.BadParameter):
        if value is not None and is_picture(background_of(value)):
            read_picture(value)
    return value


def _opaque(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value == "transparent":
        raise click.BadParameter("wanted a colour such as #d8dde2, or a picture: these pictures are opaque")
    return _background(context, parameter, value)


completing_faces = completing("realizer.face.load:face_folders")


def face(what: str, **attributes: Any) -> Decorator:
    """Return the option --face; `what` says what the face is for."""
    return option(
        "--face NAME|PATH",
        f"{what}: a name of `realizer faces list`, a face folder, or a GLB head.",
        callback=lambda context, parameter, value: check_face(value),
        shell_complete=completing_faces,
        **attributes,
    )


def _style(name: str, moves: str) -> Decorator:
    words = f"How far the {moves} in speech: 0 mumbles, 2 over-articulates.  [default: 1]"
    return option(f"--{name} 0..2", words, click.FloatRange(0, 2))


documents = click.argument(
    "documents", nargs=-1, required=True, metavar="DOC|TEXT...", type=click.Path(allow_dash=True)
)
as_json = option("--json", "Print JSON.", name="as_json", is_flag=True)
fps = option("--fps", "Frames per second.  [default: 25]", Number(0, 240, min_open=True))
deformer = option(
    "--deformer",
    "Move the face by FAPs (mpeg4) or by its action unit model (au).  [default: the face's own choice]",
    click.Choice(["mpeg4", "au"]),
)
MAPPING = MappingFile(exists=True, dir_okay=False, path_type=Path)
mapping = option(
    "--mapping FILE|zhang|raouzaiou",
    "Mapping of action units to FAPs, as `realizer faces mapping` writes it, or a published one, that "
    "overrides the face's.",
    MAPPING,
)

size = option("--size WxH", "Size of pictures in pixels.", default="512x512", callback=parse_size)
completing_cameras = completing("realizer.render.cameras:PRESETS")
camera = option("--camera", CAMERAS, default="front", shell_complete=completing_cameras)
at = option("--at SECONDS", "With .png: draw this instant instead of a contact sheet.", Number(0))
light = option(
    "--light NAME",
    "portrait (soft and warm), daylight (even, shows every feature), evening (one cheek in shade), studio "
    "(neutral, from both sides) or outdoors (low sun).  [default: portrait]",
    shell_complete=completing("realizer.render.light:presets"),
    callback=lambda context, parameter, value: check_light(value),
)
background = option(
    "--background COLOUR|FILE",
    "What is behind the head: a colour such as '#d8dde2', a picture (PNG, JPEG, WebP), or transparent.  "
    "[default: the light's own]",
    callback=_background,
)
opaque_background = option(
    "--background COLOUR|FILE",
    "What is behind the head: a colour such as '#d8dde2', or a picture (PNG, JPEG, WebP).  "
    "[default: the light's own]",
    callback=_opaque,
)

liveliness = option(
    "--liveliness 0..1",
    "How much an idle face breathes, changes its posture and varies its blinks; 0 with --no-idle.  "
    "[default: 1]",
    Number(0, 1),
)
prosody = option(
    "--prosody",
    "Small nods, raised brows, blinks and glances that accompany speech; off with --no-idle.  [default: on]",
    click.Choice(["on", "off"]),
)
cooccurrence = option(
    "--cooccurrence on|off|FILE",
    "Rules for action units that no face shows together: the built-in ones, none, or a file.  [default: on]",
)
motion_options = several(
    liveliness, prosody, _style("jaw", "jaw moves"), _style("lips", "lips move"), cooccurrence, mapping
)

voice = option(
    "--voice NAME",
    "Voice to speak with; see `realizer voices`.",
    shell_complete=completing("realizer.speech.registry:VOICES"),
)
language = option("--language TAG", "Language of text without xml:lang, as a BCP-47 tag.  [default: en-US]")
scene = option("--scene", "File of gaze and pointing targets, one a line: NAME X Y Z, in metres.", FILE)
media = option("--media DIR", "Folder of the files that documents may refer to.", FOLDER)
expressions = option(
    "--expressions DIR",
    "Folder of your own expressions, one .toml file each; they override built-in ones.",
    FOLDER,
)
strict_bml = option(
    "--strict-bml/--lenient-bml",
    "Read documents as BML 1.0 only, or also as its drafts and the dialects of other realizers.  "
    "[default: --lenient-bml]",
    default=None,
)
strict = option("--strict", "Exit with 1 if any behaviour was dropped.", is_flag=True)
playback_options = several(voice, language, scene, media, expressions, strict_bml, strict)
