"""Journals of sessions: another process can resume them, and recordings can be replayed."""

from realizer.server.journal.entry import Entry, Journal, JournalError, SavedSession, TakenOver

__all__ = ["Entry", "Journal", "JournalError", "SavedSession", "TakenOver", "journal_at"]


def journal_at(address: str) -> Journal:
    """Return the journal at an address: redis://HOST:PORT/N, which several hosts can share, or a file.

    Raises:
        JournalError: it cannot be opened, or a package is not installed.
    """
    if address.startswith(("redis://", "rediss://", "unix://")):
        from realizer.server.journal.redis_journal import RedisJournal

        return RedisJournal(address)
    path = address.removeprefix("sqlite://")
    if "://" in path:  # the address is not quoted: it may contain a password
        raise JournalError(
            "the journal: wanted a file, or redis://HOST:PORT/NUMBER, got an address of another kind"
        )
    from realizer.server.journal.sqlite_journal import SqliteJournal

    return SqliteJournal(path)
