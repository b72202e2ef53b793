"""What is written for a session, and what becomes of it where that cannot be."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from realizer.server.journal import JournalError, SavedSession
from realizer.server.journal.entry import Entry
from realizer.server.journal.journal_writer import AGAIN, BYTES, ENTRIES, JournalWriter
from realizer.server.journal.recordings import RecordingFolder, read_record
from tests.interleavings import Memory


class Full(RecordingFolder):
    """A record on a disk that is full."""

    def add(self, session: str, entry: Entry) -> None:
        raise JournalError("no space left")


def test_a_record_that_fails_is_stopped_and_counted_and_the_journal_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal, stopped = Memory(), []
    notes = JournalWriter("s", journal, Full(tmp_path, {}), stopped=lambda: stopped.append(1))
    notes.begin(0.0)
    with caplog.at_level(logging.WARNING):
        for at in (1.0, 2.0, 3.0):
            notes.append(at, "text", 1, "<bml/>")
    assert [entry.at for entry in journal.entries["s"]] == [1.0, 2.0, 3.0]
    assert stopped == [1]
    assert [record.getMessage() for record in caplog.records] == [
        "session s is recorded no further: no space left"
    ]


def test_a_record_that_cannot_begin_refuses_nobody(tmp_path: Path) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    notes = JournalWriter("s", Memory(), record, stopped=lambda: stopped.append(1))
    notes.begin(0.0)
    notes.append(1.0, "join", 1)
    assert stopped == [1]


def test_a_record_that_cannot_go_on_refuses_nobody(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    kept = SavedSession(0.0, [Entry(1.0, "join", 1)])
    notes = JournalWriter("s", Memory(), record, stopped=lambda: stopped.append(1), saved=kept)
    with caplog.at_level(logging.WARNING):
        notes.resume(kept)
    assert stopped == [1]
    assert "s is recorded no further" in caplog.text


def test_a_record_has_all_that_was_done_though_the_journal_has_no_room(tmp_path: Path) -> None:
    full = False
    notes = JournalWriter("s", Memory(lambda: full), RecordingFolder(tmp_path, {}))
    notes.begin(0.0)
    notes.append(1.0, "join", 1)
    full = True
    with pytest.raises(JournalError):
        notes.append(2.0, "text", 1, "which is not taken")
    notes.try_append(3.0, "tick")
    notes.end()
    (path,) = tmp_path.iterdir()
    assert read_record(path).entries == (Entry(1.0, "join", 1), Entry(3.0, "tick"))


def test_a_checkpoint_is_due_after_so_many_entries_or_bytes_also_of_one_that_was_taken_over() -> None:
    def notes(kept: list[Entry]) -> JournalWriter:
        made = JournalWriter("s", Memory(), saved=SavedSession(0.0, kept))
        made.begin(0.0)
        return made

    many = notes([Entry(1.0, "tick")] * (ENTRIES - 1))
    assert not many.needs_checkpoint
    many.try_append(2.0, "tick")
    assert many.needs_checkpoint
    assert many.compact({"state": ""})
    assert not many.needs_checkpoint
    large = notes([Entry(1.0, "sound", 1, bytes(BYTES - 1))])
    assert not large.needs_checkpoint
    large.append(2.0, "text", 1, "x")
    assert large.needs_checkpoint


def test_what_a_journal_lacks_a_checkpoint_brings_as_soon_as_there_is_room() -> None:
    full = True
    journal = Memory(lambda: full)
    notes = JournalWriter("s", journal)
    notes.begin(0.0)
    notes.try_append(1.0, "tick")
    assert notes.needs_checkpoint
    assert not notes.compact({"state": "x"})
    assert not notes.needs_checkpoint
    full = False
    for _ in range(AGAIN):
        notes.try_append(2.0, "tick")
    assert notes.needs_checkpoint
    assert notes.compact({"state": "x"})
    assert journal.claim("s") == SavedSession(1.7e9, [], {"state": "x"})


def test_a_journal_that_only_grows_is_told_of_now_and_then(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("realizer.server.journal.journal_writer.ENDLESS", 10)
    notes = JournalWriter("s", Memory())
    notes.begin(0.0)
    with caplog.at_level(logging.WARNING):
        for _ in range(25):
            notes.try_append(1.0, "tick")
    assert [record.args for record in caplog.records] == [("s", 10), ("s", 20)]


def test_a_session_that_is_only_recorded_is_never_compacted(tmp_path: Path) -> None:
    notes = JournalWriter("s", record=RecordingFolder(tmp_path, {}))
    notes.begin(0.0)
    for _ in range(2 * ENTRIES):
        notes.try_append(1.0, "tick")
    assert not notes.needs_checkpoint
    notes.end()
