"""The journal in a SQLite file: its size, its age and the files of version 1."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from realizer.server.journal import Entry, JournalError, SavedSession, journal_at
from realizer.server.journal.entry import RETENTION
from realizer.server.journal.sqlite_journal import SqliteJournal
from tests.realizer.server.journal.conftest import Clock

pytestmark = pytest.mark.usefixtures("clock")

FIRST = Entry(0.0, "join", 1)
# A file of version 1: its tables, and the entries of one session.
VERSION_1 = """
CREATE TABLE sessions (id TEXT PRIMARY KEY, owner TEXT NOT NULL, epoch REAL NOT NULL);
CREATE TABLE entries (n INTEGER PRIMARY KEY, session TEXT NOT NULL, line TEXT NOT NULL);
CREATE TABLE parts (
    session TEXT NOT NULL, name TEXT NOT NULL, text TEXT NOT NULL, PRIMARY KEY (session, name)
);
INSERT INTO sessions VALUES ('s', 'a dead process', 1000.5);
INSERT INTO parts VALUES ('s', 'state', '{"at": 0.5}');
INSERT INTO entries VALUES (7, 's', '{"at": 1.0, "kind": "join", "number": 2}');
INSERT INTO entries VALUES (8, 's', '{"at": 1.25, "kind": "text", "number": 2, "body": "<bml/>"}');
INSERT INTO entries VALUES (9, 's', '{"at": 1.5, "kind": "sound", "number": 2, "sound": "AAEC"}');
INSERT INTO entries VALUES (11, 's', '{"at": 2.0, "kind": "spoken", "number": 3}');
INSERT INTO entries VALUES (12, 's', '{"at": 2.5, "kind": "tick"}');
"""


def test_sqlite_journal_reads_a_file_of_version_1(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    with sqlite3.connect(path) as file:
        file.executescript(VERSION_1)
    assert journal_at(str(path)).claim("s") == SavedSession(
        1000.5,
        [
            Entry(1.0, "join", 2),
            Entry(1.25, "text", 2, "<bml/>"),
            Entry(1.5, "sound", 2, b"\0\1\2"),
            Entry(2.0, "spoken", 3),
            Entry(2.5, "tick"),
        ],
        {"state": '{"at": 0.5}'},
    )


def test_sqlite_journal_sets_aside_a_line_that_is_no_entry(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "journal.db"
    journal = journal_at(str(path))
    journal.begin("s", 0.0)
    journal.add("s", FIRST)
    with sqlite3.connect(path) as file:
        file.execute("INSERT INTO entries (session, line) VALUES ('s', 'BML')")
    saved = journal.claim("s")
    assert saved is not None
    assert [entry.kind for entry in saved.entries] == [FIRST.kind, "tick"]
    assert "wanted an entry of a journal, got 'BML'" in caplog.text


def test_sqlite_journal_is_unchanged_by_a_checkpoint_that_fails(tmp_path: Path) -> None:
    journal = SqliteJournal(tmp_path / "journal.db")
    journal.begin("s", 0.0)
    journal.add("s", FIRST)
    (used,) = journal._file.execute("PRAGMA page_count").fetchone()
    journal._file.execute(f"PRAGMA max_page_count = {used}")
    # Clients get the text: it has no path.
    with pytest.raises(JournalError, match=r"^the journal: database or disk is full$"):
        journal.compact("s", {"state": "small", "clip:a": "x" * 100_000})
    assert journal.claim("s") == SavedSession(0.0, [FIRST])


def test_sqlite_journal_deletes_sessions_that_nobody_resumed(tmp_path: Path, clock: Clock) -> None:
    begin, path = clock.now, str(tmp_path / "journal.db")
    journal = journal_at(path)
    for name in ("left", "entry", "checkpoint", "both"):
        journal.begin(name, begin)
    journal.add("entry", Entry(100.0, "sound", 1, b"x"))
    journal.compact("checkpoint", {"state": '{"at": 100.0}', "clip:c": "{}"})
    journal.compact("both", {"state": '{"at": 50.0}'})
    journal.add("both", Entry(100.0, "tick"))
    clock.now = begin + RETENTION + 1
    journal = journal_at(path)
    assert journal.claim("left") is None
    assert all(journal.claim(name) is not None for name in ("entry", "checkpoint", "both"))
    clock.now = begin + RETENTION + 101
    journal = journal_at(path)
    assert not any(journal.claim(name) for name in ("entry", "checkpoint", "both"))


def test_sqlite_journal_does_not_change_another_file(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("something of mine, of more than a few bytes\n" * 40)
    with pytest.raises(JournalError, match="not a database"):
        journal_at(str(path))
    assert path.read_text().startswith("something of mine")
