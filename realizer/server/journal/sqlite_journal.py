"""The journal in a SQLite file, which the workers of one machine share."""

import contextlib
import json
import secrets
import sqlite3
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from time import time

from realizer.server.journal.entry import NOTE, RETENTION, Entry, JournalError, SavedSession, TakenOver

# The tables of version 1; later versions must read them.
TABLES = """
CREATE TABLE IF NOT EXISTS sessions (id TEXT PRIMARY KEY, owner TEXT NOT NULL, epoch REAL NOT NULL);
CREATE TABLE IF NOT EXISTS entries (n INTEGER PRIMARY KEY, session TEXT NOT NULL, line TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS of_session ON entries (session, n);
CREATE TABLE IF NOT EXISTS parts (
    session TEXT NOT NULL, name TEXT NOT NULL, text TEXT NOT NULL, PRIMARY KEY (session, name)
);
"""
# POSIX time of the last entry or checkpoint of each session.
LAST = """
SELECT id, epoch + max(
    coalesce((SELECT json_extract(line, '$.at') FROM entries
        WHERE session = id AND json_valid(line) ORDER BY n DESC LIMIT 1), 0),
    coalesce((SELECT json_extract(text, '$.at') FROM parts
        WHERE session = id AND name = 'state' AND json_valid(text)), 0)
) FROM sessions
"""
TAKEN = "SELECT id FROM sessions WHERE owner != ? AND id IN (SELECT value FROM json_each(?))"
BUSY = 2.0  # s; how long a write waits for one of another worker


class SqliteJournal:
    """A journal in a file, which is created if it is missing; several workers of one host may share it.

    A killed process loses no entry, a host that loses power may lose the last ones. Space of deleted entries
    is used again, but the file does not shrink.

    Raises:
        JournalError: the file cannot be opened, or is not a journal.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path
        self._owner = secrets.token_hex(8)
        with self._translate_errors(f" {path}"):
            # Each statement is its own transaction, so that an added entry is stored at once.
            self._file = sqlite3.connect(path, timeout=BUSY, isolation_level=None)
            self._file.execute("PRAGMA journal_mode=WAL")
            self._file.execute("PRAGMA synchronous=NORMAL")
            self._file.executescript(TABLES)
        with self._transaction():
            for session, last in self._file.execute(LAST).fetchall():
                if last < time() - RETENTION:
                    self._forget(session)

    def begin(self, session: str, epoch: float) -> None:
        with self._transaction():
            self._forget(session)
            self._file.execute("REPLACE INTO sessions VALUES (?, ?, ?)", (session, self._owner, epoch))

    def add(self, session: str, entry: Entry) -> None:
        with self._translate_errors():
            done = self._file.execute(
                "INSERT INTO entries (session, line) SELECT id, ? FROM sessions WHERE id = ? AND owner = ?",
                (entry.line(), session, self._owner),
            )
        if not done.rowcount:
            raise TakenOver(session)

    def claim(self, session: str) -> SavedSession | None:
        with self._transaction():
            row = self._file.execute(
                "UPDATE sessions SET owner = ? WHERE id = ? RETURNING epoch", (self._owner, session)
            ).fetchone()
            entries = "SELECT line FROM entries WHERE session = ? ORDER BY n"
            lines = [line for (line,) in self._file.execute(entries, (session,))]
            parts = dict(self._file.execute("SELECT name, text FROM parts WHERE session = ?", (session,)))
        place = f"the journal of session {session}, entry "
        return None if row is None else SavedSession.read(row[0], lines, parts, place=place)

    def note(self, session: str, text: str | None) -> None:
        with self._transaction():
            self._check_owner(session)
            self._set_part(session, NOTE, text)

    def replace(self, session: str, index: int, entry: Entry) -> None:
        with self._transaction():
            self._check_owner(session)
            places = "SELECT n FROM entries WHERE session = ? ORDER BY n LIMIT 1 OFFSET ?"
            done = self._file.execute(
                f"UPDATE entries SET line = ? WHERE n = ({places})", (entry.line(), session, index)
            )
            if not done.rowcount:
                raise JournalError(f"the journal: wanted entry {index} of session {session}, found none")
            self._set_part(session, NOTE, None)

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        # The main connection belongs to the thread that writes.
        with self._translate_errors(), contextlib.closing(sqlite3.connect(self._path, timeout=BUSY)) as file:
            return {id for (id,) in file.execute(TAKEN, (self._owner, json.dumps(list(sessions))))}

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        with self._transaction():
            self._check_owner(session)
            self._file.execute("DELETE FROM entries WHERE session = ?", (session,))
            for name, text in parts.items():
                self._set_part(session, name, text)

    def end(self, session: str) -> None:
        with contextlib.suppress(JournalError), self._transaction():
            self._check_owner(session)
            self._forget(session)

    def close(self) -> None:
        with contextlib.suppress(sqlite3.Error):
            self._file.close()

    def _check_owner(self, session: str) -> None:
        query = "SELECT 1 FROM sessions WHERE id = ? AND owner = ?"
        if self._file.execute(query, (session, self._owner)).fetchone() is None:
            raise TakenOver(session)

    def _set_part(self, session: str, name: str, text: str | None) -> None:
        if text is None:
            self._file.execute("DELETE FROM parts WHERE session = ? AND name = ?", (session, name))
        else:
            self._file.execute("REPLACE INTO parts VALUES (?, ?, ?)", (session, name, text))

    def _forget(self, session: str) -> None:
        for table, column in (("entries", "session"), ("parts", "session"), ("sessions", "id")):
            self._file.execute(f"DELETE FROM {table} WHERE {column} = ?", (session,))

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._translate_errors():
            self._file.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._file.execute("COMMIT")
            except BaseException:
                self._file.rollback()
                raise

    @contextlib.contextmanager
    def _translate_errors(self, place: str = "") -> Iterator[None]:
        """Raise errors as JournalError, without the path: clients get the text."""
        try:
            yield
        except (sqlite3.Error, OSError) as error:
            raise JournalError(f"the journal{place}: {error}") from None
