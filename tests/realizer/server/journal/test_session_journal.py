"""Tests of the journal of a session."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from bml_schema.feedback import WarningFeedback
from realizer.core.settings import Settings
from realizer.server.journal import Journal, SavedSession
from realizer.server.journal.entry import Entry, JournalError, TakenOver
from realizer.server.journal.recordings import RecordingFolder, read_recording
from realizer.server.journal.session_journal import AGAIN, BYTES, ENTRIES, SessionJournal
from realizer.server.journal.sqlite_journal import SqliteJournal
from realizer.server.session.effects import Close
from realizer.server.session.session import Session
from tests.interleavings import Memory
from tests.realizer.server.conftest import Driver


def test_session_sends_a_warning_without_seq_if_the_journal_is_full() -> None:
    class Full(SqliteJournal):
        full = False

        def add(self, session: str, entry: Entry) -> None:
            if self.full:
                raise JournalError("no room")
            super().add(session, entry)

    driver, journal = Driver(named=True), Full(":memory:")
    driver.session.journal.open(journal)
    driver.session.journal.begin(0.0)
    client = driver.send({"type": "speech", "id": "turn", "append": "One. "})
    journal.full = True
    driver.send('<bml id="turn"><wait id="w"/></bml>')
    journal.full = False
    driver.send({"type": "speech", "id": "turn", "append": "Two.", "close": True})
    driver.run(10)
    (warning,) = (f for f in client.feedback if isinstance(f, WarningFeedback))
    assert (warning.id, warning.seq) == ("turn", None)
    assert "no room" in warning.text
    numbers = sorted(f.seq for f in client.feedback if f.seq is not None)
    assert len(numbers) == len(client.feedback) - 1
    assert numbers == list(range(1, len(numbers) + 1))
    assert "turn.2:end" in client.ids, "the speech of that name goes on"


def test_hand_over_closes_all_connections() -> None:
    class Taken(SqliteJournal):
        def add(self, session: str, entry: Entry) -> None:
            raise TakenOver(session)

    driver = Driver(named=True)
    driver.session.journal.open(Taken(":memory:"))
    driver.join(2)
    assert driver.closed == [Close(k, 1012, "session test is another process's now") for k in (1, 2)]


def opened(
    journal: Journal | None = None, recorder: RecordingFolder | None = None, **options: Any
) -> SessionJournal:
    """Return the journal of a session in which nothing plays."""
    session = Session("s", Settings(voice="silent"), 0.0, named=True)
    session.journal.open(journal, recorder, **options)
    session.journal.begin(0.0)
    return session.journal


class Full(RecordingFolder):
    """A record on a disk that is full."""

    def add(self, session: str, entry: Entry) -> None:
        raise JournalError("no space left")


def test_journal_stops_and_counts_a_recording_that_fails(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal, stopped = Memory(), []
    notes = opened(journal, Full(tmp_path, {}), on_stopped=lambda: stopped.append(1))
    with caplog.at_level(logging.WARNING):
        for at in (1.0, 2.0, 3.0):
            assert notes.accept(at, "text", 1, "<bml/>") is None
    assert [entry.at for entry in journal.entries["s"]] == [1.0, 2.0, 3.0]
    assert stopped == [1]
    assert [record.getMessage() for record in caplog.records] == [
        "the recording of session s has stopped: no space left"
    ]


def test_journal_calls_follow_as_long_as_it_returns_true() -> None:
    answers = iter([True, True, False])
    writer = opened(Memory(), follow=lambda: next(answers))
    for at in range(5):
        writer.note(float(at), "tick")
    assert list(answers) == []


def test_journal_goes_on_if_a_recording_cannot_begin(tmp_path: Path) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    notes = opened(Memory(), record, on_stopped=lambda: stopped.append(1))
    notes.note(1.0, "join", 1)
    assert stopped == [1]


def test_journal_goes_on_if_a_recording_cannot_be_resumed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    kept = SavedSession(0.0, [Entry(1.0, "join", 1)])
    notes = opened(Memory(), record, on_stopped=lambda: stopped.append(1))
    with caplog.at_level(logging.WARNING):
        notes.resume(kept)
    assert stopped == [1]
    assert "s has stopped" in caplog.text


def test_journal_records_all_events_although_the_journal_is_full(tmp_path: Path) -> None:
    full = False
    notes = opened(Memory(lambda: full), RecordingFolder(tmp_path, {}))
    notes.note(1.0, "join", 1)
    full = True
    assert "could not be written" in str(notes.accept(2.0, "text", 1, "which is not taken"))
    notes.note(3.0, "tick")
    notes.end()
    (path,) = tmp_path.iterdir()
    assert read_recording(path).entries == [Entry(1.0, "join", 1), Entry(3.0, "tick")]


def test_journal_needs_a_checkpoint_after_many_entries_or_bytes() -> None:
    def notes(kept: list[Entry]) -> SessionJournal:
        made = opened(Memory())
        made.resume(SavedSession(0.0, kept))
        return made

    many = notes([Entry(1.0, "tick")] * (ENTRIES - 1))
    assert not many.needs_checkpoint
    many.note(2.0, "tick")
    assert many.needs_checkpoint
    assert many.compact(3.0)
    assert not many.needs_checkpoint
    large = notes([Entry(1.0, "sound", 1, bytes(BYTES - 1))])
    assert not large.needs_checkpoint
    large.accept(2.0, "text", 1, "x")
    assert large.needs_checkpoint


def test_journal_makes_up_for_lost_entries_by_a_checkpoint() -> None:
    full = True
    journal = Memory(lambda: full)
    notes = opened(journal)
    notes.note(1.0, "tick")
    assert notes.needs_checkpoint
    notes.compact(1.0)
    assert not notes.needs_checkpoint
    full = False
    for _ in range(AGAIN):
        notes.note(2.0, "tick")
    assert notes.needs_checkpoint
    notes.compact(2.0)
    saved = journal.claim("s")
    assert saved is not None
    assert (saved.entries, list(saved.parts)) == ([], ["state"])


def test_journal_warns_now_and_then_of_a_journal_that_only_grows(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("realizer.server.journal.session_journal.ENDLESS", 10)
    notes = opened(Memory())
    with caplog.at_level(logging.WARNING):
        for _ in range(25):
            notes.note(1.0, "tick")
    assert [record.args for record in caplog.records] == [("s", 10), ("s", 20)]


def test_journal_never_compacts_a_session_that_is_only_recorded(tmp_path: Path) -> None:
    notes = opened(None, RecordingFolder(tmp_path, {}))
    for _ in range(2 * ENTRIES):
        notes.note(1.0, "tick")
    assert not notes.needs_checkpoint
    notes.end()
