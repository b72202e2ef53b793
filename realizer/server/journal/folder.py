"""A journal to look at and to play again: a file of JSON lines for each session, in a folder."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Any

from realizer.behaviours.kind import Position
from realizer.server.journal.entry import Entry, JournalError
from realizer.settings import Settings

__all__ = ["FolderJournal", "Record", "head", "read_record"]

SUFFIX = ".jsonl"


class FolderJournal:
    """Records every session, of which nothing is taken back: `SESSION-TIME.jsonl`, the head first.

    Args:
        folder: made where it is not there.
        head: what else is told first of each session; plain data.

    Raises:
        JournalError: it cannot be made.
    """

    def __init__(self, folder: Path, head: Mapping[str, Any]) -> None:
        self._folder = folder
        self._head = dict(head)
        self._files: dict[str, FileIO] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise JournalError(f"the folder of records {folder}: {error.strerror}") from None

    def begin(self, session: str, epoch: float) -> None:
        self.end(session)
        began = time.strftime("%Y%m%dT%H%M%S", time.gmtime(epoch)) + f"{epoch % 1:.3f}"[1:]
        path = self._folder / f"{session}-{began}{SUFFIX}"
        try:
            file = self._files[session] = path.open("wb", buffering=0)
            _write(file, json.dumps({"session": session, "epoch": epoch, **self._head}))
        except OSError as error:
            raise JournalError(f"the record {path}: {error.strerror}") from None

    def add(self, session: str, entry: Entry) -> None:
        if (file := self._files.get(session)) is None:
            return
        try:
            _write(file, entry.line())
        except OSError as error:
            raise JournalError(f"the record {file.name}: {error.strerror}") from None

    def end(self, session: str) -> None:
        if (file := self._files.pop(session, None)) is not None:
            with contextlib.suppress(OSError):
                file.close()

    def close(self) -> None:
        for session in list(self._files):
            self.end(session)


def _write(file: FileIO, line: str) -> None:
    """The whole line or nothing of it: a disk may be full in the middle, and have room again later."""
    begin = file.tell()
    data = memoryview(f"{line}\n".encode())
    try:
        while data:
            data = data[file.write(data) :]
    except OSError:
        with contextlib.suppress(OSError):
            file.seek(begin)
            file.truncate()
        raise


# Settings that change what is seen and heard, or what is taken at all.
SHOWN = (
    *("face", "deformer", "voice", "language", "fps", "seed", "idle", "prosody", "cooccurrence"),
    *("mapping", "media", "expressions"),
    *("max_document", "max_elements", "max_behaviours", "max_duration", "max_blocks", "max_speech"),
)


def head(settings: Settings, scene: Mapping[str, Position] | None) -> dict[str, Any]:
    """What a record tells first, beside which session it is."""
    told = {name: getattr(settings, name) for name in SHOWN}
    told = {name: str(value) if isinstance(value, Path) else value for name, value in told.items()}
    return {
        "settings": {name: value for name, value in told.items() if value is not None},
        "scene": None if scene is None else {name: list(at) for name, at in scene.items()},
    }


@dataclass(frozen=True)
class Record:
    """What was recorded of a session.

    Attributes:
        head: what was told first: `session`, `epoch`, `settings`, `scene`.
    """

    head: Mapping[str, Any]
    entries: tuple[Entry, ...]


def read_record(path: Path) -> Record:
    """A record; the last line of one that broke off may be half.

    Raises:
        JournalError: it is none; with its line.
    """
    try:
        first, *lines = path.read_text("utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise JournalError(f"{path}: {error}") from None
    try:
        head = json.loads(first)
        head["epoch"] + 0.0, head["session"] + ""
    except (ValueError, TypeError, KeyError):
        raise JournalError(f"{path}:1: wanted the head of a record, got {first[:80]!r}") from None
    entries = []
    for number, line in enumerate(lines, 2):
        if number == len(lines) + 1:
            break  # what is behind the last line feed was not written to its end
        try:
            entries.append(Entry.read(line))
        except JournalError as error:
            raise JournalError(f"{path}:{number}: {error}") from None
    return Record(head, tuple(entries))
