"""Tests of the journal of a session."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from bml_schema.feedback import WarningFeedback
from realizer.server.journal import SavedSession
from realizer.server.journal.entry import Entry, JournalError, TakenOver
from realizer.server.journal.recordings import RecordingFolder, read_recording
from realizer.server.journal.session_journal import AGAIN, BYTES, ENTRIES, JournalWriter
from realizer.server.journal.sqlite_journal import SqliteJournal
from realizer.server.session.effects import Close
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
    driver.session.journal.writer = JournalWriter("test", journal)
    driver.session.journal.writer.begin(0.0)
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
    driver.session.journal.writer = JournalWriter("test", Taken(":memory:"))
    driver.join(2)
    assert driver.closed == [Close(k, 1012, "session test is another process's now") for k in (1, 2)]


class Full(RecordingFolder):
    """A record on a disk that is full."""

    def add(self, session: str, entry: Entry) -> None:
        raise JournalError("no space left")


def test_writer_stops_and_counts_a_recording_that_fails(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal, stopped = Memory(), []
    notes = JournalWriter("s", journal, Full(tmp_path, {}), on_stopped=lambda: stopped.append(1))
    notes.begin(0.0)
    with caplog.at_level(logging.WARNING):
        for at in (1.0, 2.0, 3.0):
            notes.append(at, "text", 1, "<bml/>")
    assert [entry.at for entry in journal.entries["s"]] == [1.0, 2.0, 3.0]
    assert stopped == [1]
    assert [record.getMessage() for record in caplog.records] == [
        "the recording of session s has stopped: no space left"
    ]


def test_writer_calls_follow_as_long_as_it_returns_true() -> None:
    answers = iter([True, True, False])
    writer = JournalWriter("s", Memory(), follow=lambda: next(answers))
    writer.begin(0.0)
    for at in range(5):
        writer.append(float(at), "tick", 0, "")
    assert list(answers) == []


def test_writer_goes_on_if_a_recording_cannot_begin(tmp_path: Path) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    notes = JournalWriter("s", Memory(), record, on_stopped=lambda: stopped.append(1))
    notes.begin(0.0)
    notes.append(1.0, "join", 1)
    assert stopped == [1]


def test_writer_goes_on_if_a_recording_cannot_be_resumed(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "records"
    record = RecordingFolder(folder, {})
    folder.rmdir()
    stopped: list[int] = []
    kept = SavedSession(0.0, [Entry(1.0, "join", 1)])
    notes = JournalWriter("s", Memory(), record, on_stopped=lambda: stopped.append(1), saved=kept)
    with caplog.at_level(logging.WARNING):
        notes.resume(kept)
    assert stopped == [1]
    assert "s has stopped" in caplog.text


def test_writer_records_all_events_although_the_journal_is_full(tmp_path: Path) -> None:
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
    assert read_recording(path).entries == [Entry(1.0, "join", 1), Entry(3.0, "tick")]


def test_writer_needs_a_checkpoint_after_many_entries_or_bytes() -> None:
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


def test_writer_makes_up_for_lost_entries_by_a_checkpoint() -> None:
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


def test_writer_warns_now_and_then_of_a_journal_that_only_grows(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("realizer.server.journal.session_journal.ENDLESS", 10)
    notes = JournalWriter("s", Memory())
    notes.begin(0.0)
    with caplog.at_level(logging.WARNING):
        for _ in range(25):
            notes.try_append(1.0, "tick")
    assert [record.args for record in caplog.records] == [("s", 10), ("s", 20)]


def test_writer_never_compacts_a_session_that_is_only_recorded(tmp_path: Path) -> None:
    notes = JournalWriter("s", recorder=RecordingFolder(tmp_path, {}))
    notes.begin(0.0)
    for _ in range(2 * ENTRIES):
        notes.try_append(1.0, "tick")
    assert not notes.needs_checkpoint
    notes.end()
