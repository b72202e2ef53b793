"""A journal in Redis while its server hangs, dies and comes back."""

from __future__ import annotations

import itertools
import signal
import threading

import pytest

from realizer.server.journal import Entry, JournalError, SavedSession, journal_at, redis_journal
from tests.realizer.server.journal.conftest import RedisServer

FIRST, REFUSED, LAST = (Entry(at, "text", 1, f"<bml id='b{at:g}'/>") for at in (1.0, 2.0, 3.0))


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(redis_journal, "PATIENCE", 0.2)


def test_redis_journal_loses_nothing_when_its_server_is_killed(redis_server: RedisServer) -> None:
    journal = journal_at(redis_server.url)
    journal.begin("s", 1.0)
    journal.add("s", Entry(0.5, "join", 1))
    journal.compact("s", {"state": "so far"})
    journal.add("s", FIRST)
    redis_server.kill()
    # Clients get the text: it says nothing about where the server is.
    with pytest.raises(JournalError, match=r"^the journal: Error \d+: Connection refused.$"):
        journal.add("s", REFUSED)
    redis_server.start()
    journal.add("s", LAST)
    assert journal_at(redis_server.url).claim("s") == SavedSession(1.0, [FIRST, LAST], {"state": "so far"})


@pytest.mark.usefixtures("impatient")
def test_redis_journal_deletes_entries_reported_as_not_written(
    redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(redis_journal, "PAUSE", 0.0)
    journal = journal_at(redis_server.url)
    journal.begin("s", 1.0)
    journal.add("s", FIRST)
    redis_server.process.send_signal(signal.SIGSTOP)
    with pytest.raises(JournalError, match="Timeout"):
        journal.add("s", REFUSED)
    redis_server.process.send_signal(signal.SIGCONT)
    journal.add("s", LAST)  # behind the one that was read meanwhile
    assert journal.claim("s") == SavedSession(1.0, [FIRST, LAST])


@pytest.mark.usefixtures("impatient")
def test_redis_journal_does_not_ask_a_hanging_server_again_at_once(
    redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = journal_at(redis_server.url)
    journal.begin("s", 1.0)
    now = 1000.0
    monkeypatch.setattr(redis_journal.time, "monotonic", lambda: now)
    redis_server.process.send_signal(signal.SIGSTOP)
    with pytest.raises(JournalError, match="Timeout"):
        journal.add("s", REFUSED)
    monkeypatch.setattr(redis_journal, "PATIENCE", float("inf"))
    for _ in range(100):
        with pytest.raises(JournalError, match="is asked again in 4 s"):
            journal.add("s", REFUSED)
    redis_server.process.send_signal(signal.SIGCONT)
    now += redis_journal.PAUSE
    journal.add("s", LAST)
    assert journal.claim("s") == SavedSession(1.0, [LAST])


@pytest.mark.usefixtures("impatient")
def test_redis_journal_writes_a_checkpoint_whole_or_not_at_all(
    redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(redis_journal, "PAUSE", 0.0)
    journal = journal_at(redis_server.url)
    journal.begin("s", 1.0)
    journal.compact("s", {"state": "old"})
    journal.add("s", FIRST)
    redis_server.process.send_signal(signal.SIGSTOP)
    with pytest.raises(JournalError, match="Timeout"):
        journal.compact("s", {"state": "new"})
    redis_server.process.send_signal(signal.SIGCONT)
    journal.add("s", LAST)
    old, new = SavedSession(1.0, [FIRST, LAST], {"state": "old"}), SavedSession(1.0, [LAST], {"state": "new"})
    assert journal.claim("s") in (old, new)


def test_journal_shows_the_old_or_the_new_checkpoint_to_others(where: str) -> None:
    """Another process takes the session at any moment, again and again."""
    journal, done = journal_at(where), threading.Event()
    found: list[tuple[str, ...]] = []

    def look() -> None:
        other = journal_at(where)
        while not done.is_set():
            kept = other.claim("torn")
            if kept is not None:
                found.append(
                    (
                        kept.parts.get("state", ""),
                        kept.parts.get("clip:c", ""),
                        *(e.kind for e in kept.entries),
                    )
                )
        other.close()

    looking = threading.Thread(target=look)
    looking.start()
    try:
        for k in itertools.count():
            if k >= 200 and found:
                break
            journal.begin("torn", 0.0)
            try:
                journal.add("torn", Entry(1.0, "tick"))
                journal.compact("torn", {"state": f"{k}", "clip:c": f"{k}"})
            except JournalError:
                pass  # it was taken
    finally:
        done.set()
        looking.join()
    assert set(found)
    for state, clip, *kinds in found:
        assert state == clip
        assert not (state and kinds)
    journal.end("torn")
