"""Tests of `realizer.server.journal.memory_journal`."""

from __future__ import annotations

from realizer.server.journal import memory_journal
from realizer.server.journal.entry import Entry
from realizer.server.journal.memory_journal import MemoryJournal


def test_memory_journal_keeps_what_came_after_the_last_checkpoint() -> None:
    journal = MemoryJournal()
    journal.begin("s", 7.0)
    for at in (0.0, 1.0):
        journal.add("s", Entry(at, "text", 1, "<bml/>"))
    journal.compact("s", {"state": "x", "clip:a": "y"})
    journal.add("s", Entry(2.0, "text", 1, "<bml/>"))
    journal.compact("s", {"clip:a": None})
    journal.add("s", Entry(3.0, "tick"))
    saved = journal.claim("s")
    assert saved is not None
    assert (saved.epoch, saved.parts, saved.entries) == (7.0, {"state": "x"}, [Entry(3.0, "tick")])
    journal.replace("s", 0, Entry(3.0, "aside"))
    assert saved.entries == [Entry(3.0, "aside")]
    journal.end("s")
    assert journal.claim("s") is None


def test_memory_journal_drops_a_session_that_accepts_too_much(monkeypatch) -> None:
    monkeypatch.setattr(memory_journal, "MOST", 100)
    journal = MemoryJournal()
    journal.begin("s", 0.0)
    journal.add("s", Entry(0.0, "text", 1, "x" * 101))
    assert journal.claim("s") is None
    journal.add("s", Entry(1.0, "text", 1, "y"))
    assert journal.claim("s") is None
