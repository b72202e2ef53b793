"""Journals of sessions: another process can resume them, and recordings can be replayed."""

from __future__ import annotations

from realizer.server.journal.entry import Entry, Journal, JournalError, Log, Recorder, SavedSession, TakenOver

__all__ = ["Entry", "Journal", "JournalError", "Log", "Recorder", "SavedSession", "TakenOver", "journal_at"]


def journal_at(where: str) -> Journal:
    """The journal a setting names: redis://HOST:PORT/N, which many nodes share, or a file of this machine.

    Raises:
        JournalError: it cannot be opened, or something must be installed.
    """
    if where.startswith(("redis://", "rediss://", "unix://")):
        from realizer.server.journal.redis_journal import RedisJournal

        return RedisJournal(where)
    if "://" in where.removeprefix("sqlite://"):  # as it came it may have a password in it
        raise JournalError(
            "the journal: wanted a file, or redis://HOST:PORT/NUMBER, got an address of another kind"
        )
    from realizer.server.journal.sqlite_journal import SqliteJournal

    return SqliteJournal(where.removeprefix("sqlite://"))
