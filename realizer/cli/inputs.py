"""What commands read: settings, documents and files. Faults of them are wrong usage."""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.core.options import PlayOptions
from realizer.core.settings import Settings, SettingsError

if TYPE_CHECKING:  # importing them takes longer than `--help` should
    from realizer.behaviours.kind import Position
    from realizer.playback.player import Player

DISK_FULL = (errno.ENOSPC, errno.EFBIG)


@contextmanager
def reporting(
    kind: type[Exception], prefix: str = "", wrong: Callable[[str], click.ClickException] = click.UsageError
) -> Iterator[None]:
    """Report errors of a kind to the user, by default as wrong usage."""
    try:
        yield
    except kind as error:
        raise wrong(f"{prefix}{error}") from None


def bad(option: str) -> Callable[[str], click.BadParameter]:
    """Return the error class for wrong values of an option."""
    return partial(click.BadParameter, param_hint=option)


@contextmanager
def opening(path: str | Path) -> Iterator[None]:
    """Report that `path` cannot be read or written as wrong usage; a full disk is not the user's mistake."""
    try:
        yield
    except OSError as error:
        if error.errno in DISK_FULL:
            raise
        raise click.UsageError(f"{path}: {error.strerror or error}") from None


def settings(documents: Sequence[str] = (), **flags: Any) -> Settings:
    """Return the settings from flags, REALIZER_* variables and defaults.

    Without a media folder, documents that are all in one folder find their files there.
    """
    with reporting(SettingsError):
        chosen = Settings.read(flags)
    if chosen.media is not None or not documents:
        return chosen
    from realizer.sources import folder_of

    return replace(chosen, media=folder_of(documents))


def play_settings(options: Mapping[str, Any], documents: Sequence[str] = (), **flags: Any) -> Settings:
    """Return the settings for playing documents from the options of a command and further flags."""
    names = {"voice", *(f.name for f in fields(PlayOptions) if f.name != "idle")}
    flags |= {name: options[name] for name in names if name in options}
    return settings(documents, **flags, idle=False if options["no_idle"] else None)


def planning_player(chosen: Settings, scene: Path | None) -> Player:
    """Return a player for schedules only, with the targets of a scene file."""
    from realizer.playback.player import Player

    names = ("language", "media", "expressions", "strict_bml")
    values = {name: getattr(chosen, name) for name in names}
    return Player(PlayOptions(scene=read_scene(scene), **values))


def read_scene(path: str | Path | None) -> dict[str, Position] | None:
    """Return the targets of a scene file, or None without one."""
    from realizer.behaviours.gaze_targets import parse_scene

    if path is None:
        return None
    with reporting(ValueError, f"{path}: "):
        return parse_scene(Path(path).read_text("utf-8"))


def read_documents(
    names: Iterable[str], language: str | None = None, *, plain: bool = False
) -> list[str | bytes]:
    """Return every document: `-` is standard input, and a text that names no file is spoken.

    Args:
        language: BCP-47 tag of texts; None: of the settings.
        plain: whether they are spoken sign by sign.
    """
    from realizer.sources import document_of

    texts: list[str | bytes] = []
    chosen = language or settings().language
    for number, name in enumerate(names, 1):
        with opening(name), reporting(ValueError, f"{name!r}: "):
            texts.append(
                document_of(
                    read_file(name) if name == "-" else name, number, language=chosen, plain=plain
                ).bml
            )
    return texts


def read_file(name: str) -> bytes:
    """Return the content of a file; `-` is standard input."""
    with opening(name):
        return sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()


def decode(content: bytes, name: str, wanted: str) -> str:
    """Return the text of a UTF-8 file; its name, and what it should be, are for the message."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"0x{content[error.start]:02X} at {error.start}"
        source = "standard input" if name == "-" else name
        raise click.UsageError(f"{source}: wanted {wanted} in UTF-8, got byte {byte}") from None


def check_suffix(path: Path | None, *suffixes: str) -> None:
    """Refuse a path that ends in none of the suffixes, in either case."""
    if path is not None and path.suffix.lower() not in suffixes:
        raise click.UsageError(f"{path}: wanted a name that ends in {' or '.join(suffixes)}")
