"""Detection of sessions that another process has taken over."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from realizer.core.settings import Settings
from realizer.server.journal import JournalError, TakenOver, journal_at
from realizer.server.runtime import takeovers
from realizer.server.runtime.takeovers import taken_over
from realizer.server.session.session import Session


def opened(name: str, *, named: bool = True) -> Session:
    return Session(name, Settings(), 0.0, named=named)


def test_taken_over_finds_lost_sessions_among_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(takeovers, "BATCH", 2)
    here, there = (journal_at(str(tmp_path / "journal.db")) for _ in range(2))
    sessions = [opened(f"s{number}") for number in range(5)]
    for session in sessions:
        here.begin(session.id, 0.0)
    one_s_own = opened("own", named=False)
    here.begin("own", 0.0)
    for name in ("s1", "s3", "s4", "own"):
        there.claim(name)
    sessions[3].hand_over(TakenOver("known already"))
    found = asyncio.run(taken_over(here, [*sessions, one_s_own]))
    assert found == [sessions[1], sessions[4]]
    assert asyncio.run(taken_over(there, sessions)) == [sessions[0], sessions[2]]
    here.close()
    there.close()


def test_taken_over_finds_none_if_the_journal_cannot_be_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = journal_at(str(tmp_path / "journal.db"))

    def broken(sessions: object) -> set[str]:
        raise JournalError("it does not answer")

    monkeypatch.setattr(journal, "taken_over", broken)
    assert asyncio.run(taken_over(journal, [opened("s")])) == []
    assert "it does not answer" in caplog.text
    journal.close()
