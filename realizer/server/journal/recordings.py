"""Recordings: a file of JSON lines for each session."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from typing import Any

from realizer.behaviours.kind import Position
from realizer.core.settings import Settings
from realizer.server.journal.entry import Entry, JournalError, SavedSession

SUFFIX = ".jsonl"
SHOWN_RECORDS = 20  # of those one can choose from
ROUNDING = 1e-6  # s; of times that went from one clock to another


class RecordingFolder:
    """Records every session, of which nothing is taken back: `SESSION-TIME.jsonl`, the head first.

    Args:
        folder: made where it is not there.
        head: what else is told first of each session; plain data.

    Raises:
        JournalError: it cannot be made.
    """

    def __init__(self, folder: Path, head: Mapping[str, Any]) -> None:
        self._folder = folder
        self._head: dict[str, Any] = json.loads(json.dumps(head))  # as it is read again
        self._files: dict[str, FileIO] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise JournalError(f"the folder of records {folder}: {error.strerror}") from None

    def begin(self, session: str, epoch: float) -> None:
        self.end(session)
        self._begin(session, epoch)

    def resume(self, session: str, saved: SavedSession) -> None:
        """Go on with the record of a session that was taken over; what it lacks is written first.

        Where there is none here that only lacks something at its end, or another process still writes it, a
        new one begins with what is kept. It is played from there: from the checkpoint, if there is one.

        Raises:
            JournalError: it cannot be written.
        """
        self.end(session)
        there = itertools.takewhile(os.path.exists, self._paths(session, saved.epoch))
        joined = (self._join(session, path, saved) for path in there)
        if (lacks := next((one for one in joined if one is not None), None)) is None:
            self._begin(session, saved.epoch, saved.parts)
            lacks = saved.entries
        for entry in lacks:
            self.add(session, entry)

    def _paths(self, session: str, epoch: float) -> Iterator[Path]:
        """Of a record, and of those that begin where one could not be gone on with."""
        began = time.strftime("%Y%m%dT%H%M%S", time.gmtime(epoch)) + f"{epoch % 1:.3f}"[1:]
        for more in itertools.chain([""], (f"-{number}" for number in itertools.count(2))):
            yield self._folder / f"{session}-{began}{more}{SUFFIX}"

    def _begin(self, session: str, epoch: float, parts: Mapping[str, str] = {}) -> None:
        told = {"session": session, "epoch": epoch, **self._head}
        path = self._folder
        try:
            path = next(path for path in self._paths(session, epoch) if not path.exists())
            file = self._files[session] = path.open("xb", buffering=0)
            _lock(file)
            _write(file, json.dumps(told | {"parts": dict(parts)} if parts else told))
        except OSError as error:
            if session in self._files:
                self.end(session)
                with contextlib.suppress(OSError):
                    path.unlink()  # an empty file is no record
            raise JournalError(f"the record {path}: {error.strerror}") from None

    def _join(self, session: str, path: Path, kept: SavedSession) -> list[Entry] | None:
        """Open a record behind its last whole line; what it lacks, or None where it must not grow."""
        try:
            file = path.open("r+b", buffering=0)
        except OSError:
            return None
        try:
            if _lock(file) and (lacks := self._missing_entries(read_record(path), kept)) is not None:
                file.seek(path.read_bytes().rfind(b"\n") + 1)
                file.truncate()
                self._files[session] = file
                return lacks
        except (JournalError, OSError):
            pass  # it is no record, or not to be written: another one is
        file.close()
        return None

    def _missing_entries(self, record: Record, kept: SavedSession) -> list[Entry] | None:
        """What was done last and is not in a record; None where that is not all that it lacks."""
        if any(record.head.get(name) != told for name, told in self._head.items()):
            return None  # it is gone on with under other settings
        have = list(record.entries)
        if dict(record.parts) == dict(kept.parts):
            return kept.entries[len(have) :] if have == kept.entries[: len(have)] else None
        for count in range(min(len(have), len(kept.entries)), 0, -1):
            if have[-count:] == kept.entries[:count]:
                return kept.entries[count:]
        return None

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


def _lock(file: FileIO) -> bool:
    """Let nobody else go on with a file as long as it is open; False where another process has it."""
    try:
        import fcntl
    except ImportError:  # not on every system: then nobody else is there either
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


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
        parts: what the session was where the record begins, as `SavedSession` has them; {}: it was new.
    """

    head: Mapping[str, Any]
    entries: tuple[Entry, ...]
    parts: Mapping[str, str] = field(default_factory=dict)


def read_record(path: Path) -> Record:
    """A record; the last line of one that broke off may be half.

    Args:
        path: its file, or a folder where there is no other.

    Raises:
        JournalError: it is none; with its line.
    """
    try:
        if path.is_dir():
            path = _only(path)
        first, *lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise JournalError(f"{path}: {error.strerror}") from None
    try:
        head = json.loads(first)
        _time(head["epoch"])
        head["session"] + ""
        parts = {name + "": text + "" for name, text in head.pop("parts", {}).items()}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise JournalError(f"{path}:1: wanted the head of a record, got {_quoted(first)!r}") from None
    entries: list[Entry] = []
    # What is behind the last line feed was not written to its end.
    for number, line in enumerate(lines[:-1], 2):
        try:
            entry = Entry.read(line.decode())
            _time(entry.at, entries[-1].at if entries else 0.0)
            entries.append(entry)
        except UnicodeDecodeError:
            raise JournalError(f"{path}:{number}: wanted UTF-8, got {_quoted(line)!r}") from None
        except (JournalError, ValueError) as error:
            raise JournalError(f"{path}:{number}: {error}") from None
    return Record(head, tuple(entries), parts)


def _time(at: float, least: float = float("-inf")) -> None:
    if not least - ROUNDING <= at < float("inf"):
        raise ValueError(f"at: wanted seconds, not before {least:g}, got {at:g}")


def _only(folder: Path) -> Path:
    found = sorted(path for path in folder.iterdir() if path.suffix == SUFFIX)
    if len(found) != 1:
        names = "".join(f"\n  {path}" for path in found[:SHOWN_RECORDS])
        more = "\n  ..." if len(found) > SHOWN_RECORDS else ""
        raise JournalError(f"{folder}: wanted one record (*{SUFFIX}), got {len(found)}{names}{more}")
    return found[0]


def _quoted(line: bytes) -> str:
    return line[:80].decode(errors="replace")
