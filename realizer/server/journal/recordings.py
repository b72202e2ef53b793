"""Recordings: a file of JSON lines for each session."""

import contextlib
import itertools
import json
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import fields
from io import FileIO
from pathlib import Path
from typing import Any

from realizer.behaviours.kind import Position
from realizer.core.atomic_files import lock
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings
from realizer.server.journal.entry import Entry, JournalError, SavedSession, check_time, quoted

SUFFIX = ".jsonl"
MAX_LISTED = 20  # files that an error message lists


class RecordingFolder:
    """A folder of recordings, a file `SESSION-TIME.jsonl` for each session: the head, then its entries.

    Args:
        folder: is created if it is missing.
        head: JSON data that the head of each recording contains beside the session and its epoch.

    Raises:
        JournalError: the folder cannot be created.
    """

    def __init__(self, folder: Path, head: Mapping[str, Any]) -> None:
        self._folder = folder
        self._head: dict[str, Any] = json.loads(json.dumps(head))  # as it will be read, lists for tuples
        self._files: dict[str, FileIO] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise JournalError(f"the folder of recordings {folder}: {error.strerror}") from None

    def begin(self, session: str, epoch: float) -> None:
        self.end(session)
        self._begin(session, epoch)

    def resume(self, session: str, saved: SavedSession) -> None:
        """Continue the recording of a session that was taken over, with the entries it lacks.

        If none of its recordings lacks only the last entries, or another process still writes it, a new file
        begins with the saved session: its replay starts at the checkpoint, if there is one.

        Raises:
            JournalError: the recording cannot be written.
        """
        self.end(session)
        existing = itertools.takewhile(os.path.exists, self._paths(session, saved.epoch))
        reopened = (self._reopen(session, path, saved) for path in existing)
        if (missing := next((entries for entries in reopened if entries is not None), None)) is None:
            self._begin(session, saved.epoch, saved.parts)
            missing = saved.entries
        for entry in missing:
            self.add(session, entry)

    def _paths(self, session: str, epoch: float) -> Iterator[Path]:
        """Yield the path of a session's recording, then those of its continuations."""
        began = time.strftime("%Y%m%dT%H%M%S", time.gmtime(epoch)) + f"{epoch % 1:.3f}"[1:]
        for suffix in itertools.chain([""], (f"-{number}" for number in itertools.count(2))):
            yield self._folder / f"{session}-{began}{suffix}{SUFFIX}"

    def _begin(self, session: str, epoch: float, parts: Mapping[str, str] = {}) -> None:
        head = {"session": session, "epoch": epoch, **self._head}
        path = self._folder
        try:
            path = next(path for path in self._paths(session, epoch) if not path.exists())
            file = self._files[session] = path.open("xb", buffering=0)
            lock(file)
            _write(file, json.dumps(head | {"parts": dict(parts)} if parts else head))
        except OSError as error:
            if session in self._files:
                self.end(session)
                with contextlib.suppress(OSError):
                    path.unlink()  # without a head it is not a recording
            raise JournalError(f"the recording {path}: {error.strerror}") from None

    def _reopen(self, session: str, path: Path, saved: SavedSession) -> list[Entry] | None:
        """Open a recording after its last whole line. Return the entries it lacks; None if it must stay."""
        try:
            file = path.open("r+b", buffering=0)
        except OSError:
            return None
        try:
            if lock(file) and (missing := self._missing_entries(read_recording(path), saved)) is not None:
                file.seek(path.read_bytes().rfind(b"\n") + 1)
                file.truncate()
                self._files[session] = file
                return missing
        except (JournalError, OSError):
            pass  # not a recording, or not writable
        file.close()
        return None

    def _missing_entries(self, recorded: SavedSession, saved: SavedSession) -> list[Entry] | None:
        """Return the last entries that a recording lacks; None if it lacks others or has other settings."""
        if any(recorded.head.get(name) != value for name, value in self._head.items()):
            return None
        have = recorded.entries
        if recorded.parts == saved.parts:
            return saved.entries[len(have) :] if have == saved.entries[: len(have)] else None
        for count in range(min(len(have), len(saved.entries)), 0, -1):
            if have[-count:] == saved.entries[:count]:
                return saved.entries[count:]
        return None

    def add(self, session: str, entry: Entry) -> None:
        if (file := self._files.get(session)) is None:
            return
        try:
            _write(file, entry.line())
        except OSError as error:
            raise JournalError(f"the recording {file.name}: {error.strerror}") from None

    def end(self, session: str) -> None:
        if (file := self._files.pop(session, None)) is not None:
            with contextlib.suppress(OSError):
                file.close()

    def close(self) -> None:
        for session in list(self._files):
            self.end(session)


def _write(file: FileIO, line: str) -> None:
    """Write a whole line, or nothing: a disk may be full now and have space again later."""
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


# Settings that change what a session shows, or which messages it accepts.
RECORDED_SETTINGS = (
    *(option.name for option in fields(PlayOptions) if option.name != "scene"),
    *("voice", "max_document", "max_elements", "max_behaviours", "max_duration", "max_blocks", "max_speech"),
)


def recording_head(settings: Settings, scene: Mapping[str, Position] | None) -> dict[str, Any]:
    """Return the head of a service's recordings, as JSON data."""
    values = {name: getattr(settings, name) for name in RECORDED_SETTINGS}
    return {
        "settings": {
            name: str(value) if isinstance(value, Path) else value
            for name, value in values.items()
            if value is not None
        },
        "scene": None if scene is None else {name: list(at) for name, at in scene.items()},
    }


def read_recording(path: Path) -> SavedSession:
    """Read a recording, without a last line that was cut short.

    Args:
        path: a file, or a folder with one recording.

    Raises:
        JournalError: the file is not a recording; with the number of the line.
    """
    try:
        if path.is_dir():
            path = _only_recording(path)
        first, *lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise JournalError(f"{path}: {error.strerror}") from None
    try:
        head = json.loads(first)
        check_time(epoch := head.pop("epoch"))
        head["session"] + ""
        parts = {name + "": text + "" for name, text in head.pop("parts", {}).items()}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise JournalError(f"{path}:1: wanted the head of a recording, got {quoted(first)!r}") from None
    # The text after the last line feed is a line that was cut short.
    return SavedSession.read(epoch, lines[:-1], parts, head, f"{path}:")


def _only_recording(folder: Path) -> Path:
    paths = sorted(path for path in folder.iterdir() if path.suffix == SUFFIX)
    if len(paths) != 1:
        names = "".join(f"\n  {path}" for path in paths[:MAX_LISTED])
        more = "\n  ..." if len(paths) > MAX_LISTED else ""
        raise JournalError(f"{folder}: wanted one recording (*{SUFFIX}), got {len(paths)}{names}{more}")
    return paths[0]
