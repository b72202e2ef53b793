"""Access to files of the media folder; nothing outside it is ever opened."""

import os
import re
from collections import OrderedDict
from collections.abc import Callable
from itertools import islice, product
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote, urlsplit

from realizer.behaviours.kind import Fault, PlanningContext
from realizer.core.errors import RealizerError
from realizer.core.similar import did_you_mean, similar

T = TypeVar("T")

MAX_BYTES = 64 * 2**20
MAX_NAMES = 1000  # of a folder that are searched for a similar name
MAX_CACHED = 8  # files
ENDS = (".wav", ".mp3", ".ogg", ".flac")  # of sounds that are named without a suffix

_cache: OrderedDict[tuple[Path | None, str, Any], tuple[tuple[int, int], Any]] = OrderedDict()


class MediaError(RealizerError):
    """A file that cannot be played; the message has the expected and the actual value."""


def load(name: str, context: PlanningContext, read: Callable[[bytes], T]) -> T:
    """Return a file as read by `read`, from the cache; `faults` reads it again after a change.

    Raises:
        MediaError: no such file, or it cannot be read.
    """
    cached = _cache.get((context.media, name, read))
    value: T = cached[1] if cached is not None else _read(name, context, read)
    return value


def faults(name: str, context: PlanningContext, read: Callable[[bytes], Any]) -> tuple[Fault, ...]:
    """Return why a file cannot be played; the file is checked again."""
    try:
        _read(name, context, read)
    except MediaError as error:
        return (Fault("CANNOT_CREATE_BEHAVIOR", f"fileName: {error}"),)
    return ()


def _read(name: str, context: PlanningContext, read: Callable[[bytes], T]) -> T:
    path = media_file(name, context)
    try:
        stat = path.stat()
        stamp, key = (stat.st_mtime_ns, stat.st_size), (context.media, name, read)
        cached = _cache.get(key)
        if cached is not None and cached[0] == stamp:
            known: T = cached[1]
            return known
        if stat.st_size > MAX_BYTES:
            raise MediaError(
                f"wanted at most {MAX_BYTES // 2**20} MiB, got {_quoted_name(name)} of {stat.st_size} bytes"
            )
        content = path.read_bytes()
    except OSError as error:
        raise MediaError(
            f"wanted a file that can be read, got {_quoted_name(name)}: {error.strerror}"
        ) from None
    try:
        value = read(content)
    except RealizerError as error:
        raise MediaError(f"{_quoted_name(name)}: {error}") from None
    _cache[key] = stamp, value
    while len(_cache) > MAX_CACHED:
        _cache.popitem(last=False)
    return value


def media_file(name: str, context: PlanningContext) -> Path:
    """Return the file that a document names, inside `context.media`.

    Names are relative to the folder, with "/" or, in old documents, "\\". A file: URL and a path with a drive
    letter are paths on another machine: the longest end of it that exists in the folder is used. Those of
    recorded lines have no suffix.

    Raises:
        MediaError: no folder, a name that leads elsewhere, or no such file.
    """
    if context.media is None:
        raise MediaError("wanted a media folder (--media DIR), which files are read from, got none")
    elsewhere, parts = _parts(name)
    folder = context.media.resolve()
    ends = ("", *ENDS) if "." not in parts[-1] else ("",)
    for first, end in product(range(len(parts) if elsewhere else 1), ends):
        try:
            path = folder.joinpath(*parts[first:-1], parts[-1] + end).resolve()
            inside, is_file = path.is_relative_to(folder), path.is_file()
        except (OSError, RuntimeError, ValueError):  # a name too long, a circle of links, a null byte
            continue
        if is_file and not inside:
            raise MediaError(
                f"wanted a file inside the media folder, got {_quoted_name(name)}, a link that leads out"
            )
        if is_file:
            return path
    near = _near(folder, parts)
    raise MediaError(f"wanted a file of the media folder, got {_quoted_name(name)}{near}")


def _parts(name: str) -> tuple[bool, list[str]]:
    """Return whether a name is of another machine, and its parts."""
    text, elsewhere = name.strip(), False
    if text.lower().startswith("file:"):
        text, elsewhere = unquote(urlsplit(text.replace("\\", "/")).path), True
    elif re.match(r"[A-Za-z][A-Za-z0-9+.-]+:", text):
        raise MediaError(f"wanted a file of the media folder, got an address: {_quoted_name(name)}")
    text = text.replace("\\", "/")
    drive = re.match(r"/*[A-Za-z]:", text)
    if drive:
        text, elsewhere = text[drive.end() :], True
    if text.startswith("/") and not elsewhere:
        raise MediaError(f"wanted a name relative to the media folder, got {_quoted_name(name)}")
    parts = [part for part in text.split("/") if part not in ("", ".")]
    if ".." in parts:
        raise MediaError(f'wanted a name inside the media folder, without "..", got {_quoted_name(name)}')
    if not parts:
        raise MediaError(f"wanted the name of a file, got {_quoted_name(name)}")
    return elsewhere, parts


def _near(folder: Path, parts: list[str]) -> str:
    """Return `, did you mean "hello.wav"?` if a file beside it has a similar name, else ""."""
    try:
        parent = folder.joinpath(*parts[:-1]).resolve()
        if not parent.is_relative_to(folder):
            return ""
        with os.scandir(parent) as entries:
            names = [entry.name for entry in islice(entries, MAX_NAMES)]
    except (OSError, RuntimeError, ValueError):
        return ""
    lower = {name.lower(): name for name in names}
    near = similar(parts[-1].lower(), lower, 1, 0.7)
    return did_you_mean(f'"{"/".join([*parts[:-1], lower[name]])}"' for name in near)


def _quoted_name(name: str) -> str:
    return repr(name if len(name) <= 80 else name[:80] + "...")
