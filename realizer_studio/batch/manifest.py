"""The manifest: a JSON line with the result of each document, which survives a crash."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self, TextIO

from realizer.core.atomic_files import lock, write_text
from realizer.core.errors import RealizerError
from realizer.core.json_reader import parse_json

NAME = "manifest.jsonl"
LOCK = ".manifest.lock"

Row = Mapping[str, Any]


class BusyError(RealizerError):
    """Another batch writes to the folder."""


class Manifest:
    """The manifest of a folder of outputs. One process may write it, inside `with manifest.open()`.

    A row is `{"document", "key", "status", "outputs": {suffix: {"file", "bytes", "sha256"}}, ...}`. Its
    status is "done", "refused" (a document or block could not be played; the outputs show the rest, if there
    is any) or "failed" (no outputs; "error" says why). Rows do not depend on when, where and in which order
    they were made.

    Args:
        folder: of the outputs.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / NAME
        self._rows: dict[str, Row] = {}
        self._file: TextIO | None = None

    @contextmanager
    def open(self) -> Iterator[Self]:
        """Read the rows, append to them, and sort them by document at the end.

        Raises:
            BusyError: another batch writes here.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / LOCK).open("w") as file:
            if not lock(file):
                raise BusyError(
                    f"{self.folder}: another batch writes here; wait for it, or choose another folder"
                )
            self._rows = {row["document"]: row for row in _read(self.path)}
            self._file = self.path.open("a", encoding="utf-8")
            # End a line that a crash has cut short.
            if self.path.stat().st_size and not self.path.read_bytes().endswith(b"\n"):
                self._file.write("\n")
            try:
                yield self
            finally:
                self._file.close()
                write_text(self.path, "".join(_line(self._rows[name]) for name in sorted(self._rows)))

    def is_done(self, name: str, key: str) -> Row | None:
        """Return the row of a document that need not be played again, or None.

        It has the same key and has not failed, and its outputs are unchanged.
        """
        row = self._rows.get(name)
        if row is None or row["key"] != key or row["status"] == "failed":
            return None
        return row if all(self._is_unchanged(output) for output in row["outputs"].values()) else None

    def add(self, row: Row) -> None:
        """Add a row; it is in the file when this returns."""
        assert self._file is not None
        self._rows[row["document"]] = row
        self._file.write(_line(row))
        self._file.flush()

    def _is_unchanged(self, output: Mapping[str, Any]) -> bool:
        try:
            content = (self.folder / output["file"]).read_bytes()
        except OSError:
            return False
        return bool(hashlib.sha256(content).hexdigest() == output["sha256"])


def _line(row: Row) -> str:
    return json.dumps(row, ensure_ascii=False, sort_keys=True) + "\n"


def _read(path: Path) -> Iterator[Row]:
    """Yield the rows of a file, without invalid ones such as a line that was cut short."""
    try:
        lines = path.read_text("utf-8", "replace").splitlines()
    except FileNotFoundError:
        return
    for line in lines:
        try:
            row = parse_json(line)
        except ValueError:
            continue
        if isinstance(row, dict) and {"document", "key", "status", "outputs"} <= row.keys():
            yield row
