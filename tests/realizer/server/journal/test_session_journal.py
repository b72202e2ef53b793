"""Tests of the journal of a session."""

from __future__ import annotations

from bml_schema.feedback import WarningFeedback
from realizer.server.journal.entry import Entry, JournalError, TakenOver
from realizer.server.journal.session_journal import JournalWriter
from realizer.server.journal.sqlite_journal import SqliteJournal
from realizer.server.session.effects import Close
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
