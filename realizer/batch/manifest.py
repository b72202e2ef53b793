"""The manifest: the result of each document as a JSON line; it survives a crash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from realizer.core.atomic_files import write_text
from realizer.core.errors import RealizerError

NAME = "manifest.jsonl"
LOCK = ".manifest.lock"

Row = Mapping[str, Any]


class BusyError(RealizerError):
    """Another batch writes to the folder."""


class Manifest:
    """What is known of the documents of a folder. `with` it open, one process alone may write.

    A row is `{"document", "key", "status", "outputs": {suffix: {"file", "bytes", "sha256"}}, ...}`; its
    status is "done", "refused" (a document or block had nothing to play; outputs show what was left, if
    anything was) or "failed" (there are none; "error" says why). Nothing in it depends on when, where or in
    which order it was made.

    Args:
        folder: where the outputs lie.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / NAME
        self._rows: dict[str, Row] = {}
        self._file: TextIO | None = None

    @contextmanager
    def open(self) -> Iterator[Manifest]:
        """Read what is there, add to it, and write it in order of the documents at the end.

        Raises:
            BusyError: another batch writes here.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with _exclusive(self.folder / LOCK):
            self._rows = {row["document"]: row for row in _read(self.path)}
            self._file = self.path.open("a", encoding="utf-8")
            # A line that a crash cut short is ended, so that the next one stands by itself.
            if self.path.stat().st_size and not self.path.read_bytes().endswith(b"\n"):
                self._file.write("\n")
            try:
                yield self
            finally:
                self._file.close()
                write_text(self.path, "".join(_line(self._rows[name]) for name in sorted(self._rows)))

    def is_done(self, name: str, key: str) -> Row | None:
        """The row of a document that need not be played again: same key, not failed, outputs as they were."""
        row = self._rows.get(name)
        if row is None or row["key"] != key or row["status"] == "failed":
            return None
        return row if all(self._is_unchanged(output) for output in row["outputs"].values()) else None

    def add(self, row: Row) -> None:
        """Keep a row; it is in the file when this returns."""
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
    """The rows of a file; what is no row, such as a line that was cut short, is left out."""
    try:
        lines = path.read_text("utf-8", "replace").splitlines()
    except FileNotFoundError:
        return
    for line in lines:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        if isinstance(row, dict) and {"document", "key", "status", "outputs"} <= row.keys():
            yield row


@contextmanager
def _exclusive(path: Path) -> Iterator[None]:
    """One process at a time; the lock goes with the process that holds it, however that ends."""
    try:
        import fcntl
    except ImportError:  # elsewhere than on POSIX nobody watches
        yield
        return
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise BusyError(
                f"{path.parent}: another batch writes here; wait for it, or choose another folder"
            ) from None
        yield
