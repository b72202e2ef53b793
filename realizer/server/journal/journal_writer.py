"""The writer of a session's journal and recording."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

from realizer.server.journal.entry import (
    Entry,
    Journal,
    JournalError,
    Kind,
    Recorder,
    SavedSession,
    TakenOver,
)

log = logging.getLogger(__name__)

# A checkpoint is due after so many entries, which are done again in about half a second, or so many bytes.
ENTRIES = 250
BYTES = 2**20
# So many times as much is long.
LONG = 4
# After so many, which take a good part of a minute to be done again, it is time to say so.
ENDLESS = 10_000
# And where it could not be written, again after so many.
AGAIN = 25


class JournalWriter:
    """The hand that writes for a session.

    Args:
        session: its name.
        journal: what another process would go on from; None: none does.
        record: what is played again to look at it. It may fail: nobody waits for it.
        stopped: is called when a record has failed; nothing more is written of it.
        saved: what is in the journal already.
    """

    def __init__(
        self,
        session: str,
        journal: Journal | None = None,
        record: Recorder | None = None,
        *,
        stopped: Callable[[], None] = lambda: None,
        saved: SavedSession | None = None,
    ) -> None:
        self._session = session
        self._journal = journal
        self._recorder = record
        self._stopped = stopped
        self._failing = False
        entries = [] if saved is None else saved.entries
        self._entries = len(entries)
        self._bytes = sum(len(entry.body) for entry in entries)

    @property
    def needs_checkpoint(self) -> bool:
        """A checkpoint is due."""
        return self._entries >= ENTRIES or self._bytes >= BYTES

    @property
    def is_far_too_long(self) -> bool:
        """A checkpoint was due long ago."""
        return self._entries >= LONG * ENTRIES or self._bytes >= LONG * BYTES

    def begin(self, epoch: float) -> None:
        """The session is new.

        Raises:
            JournalError: it cannot be kept.
        """
        if self._journal is not None:
            self._journal.begin(self._session, epoch)
        self._record(lambda record: record.begin(self._session, epoch))

    def resume(self, saved: SavedSession) -> None:
        """The session was taken over: its record goes on."""
        self._record(lambda record: record.resume(self._session, saved))

    def append(self, at: float, kind: Kind, number: int = 0, body: str | bytes = "") -> None:
        """What must not be done unless it is kept.

        Raises:
            Lost: another process has the session.
            JournalError: it cannot be kept.
        """
        entry = Entry(at, kind, number, body)
        self._append_to_journal(entry)
        self._record(lambda record: record.add(self._session, entry))

    def try_append(self, at: float, kind: Kind, number: int = 0, body: str | bytes = "") -> None:
        """What happens all the same. A fault is logged once, until it is over.

        Raises:
            Lost: another process has the session.
        """
        entry = Entry(at, kind, number, body)
        try:
            self._append_to_journal(entry)
        except TakenOver:
            raise
        except JournalError as error:
            self._log_failure(error)
            self._entries = ENTRIES  # what the journal lacks now, a checkpoint gives it back
        self._record(lambda record: record.add(self._session, entry))

    def compact(self, parts: Mapping[str, str | None]) -> bool:
        """A checkpoint; False where it cannot be kept: then it is due again soon.

        Raises:
            Lost: another process has the session.
        """
        try:
            if self._journal is not None:
                self._journal.compact(self._session, parts)
        except TakenOver:
            raise
        except JournalError as error:
            self._log_failure(error)
            self._entries, self._bytes = ENTRIES - AGAIN, 0
            return False
        self._entries = self._bytes = 0
        return True

    def end(self) -> None:
        """The session is over."""
        for one in (self._journal, self._recorder):
            if one is not None:
                one.end(self._session)

    def _append_to_journal(self, entry: Entry) -> None:
        if self._journal is None:
            return
        self._journal.add(self._session, entry)
        self._failing = False
        self._entries += 1
        self._bytes += len(entry.body)
        if self._entries % ENDLESS == 0:
            log.warning(
                "session %s: %d entries in its journal and no checkpoint: some block always plays or waits",
                self._session,
                self._entries,
            )

    def _record(self, write: Callable[[Recorder], None]) -> None:
        """A record has all or ends: one with a hole would be played otherwise than the session was."""
        if self._recorder is None:
            return
        try:
            write(self._recorder)
        except JournalError as error:
            log.warning("session %s is recorded no further: %s", self._session, error)
            self._recorder.end(self._session)
            self._recorder = None
            self._stopped()

    def _log_failure(self, error: JournalError) -> None:
        if not self._failing:
            log.error("session %s: %s", self._session, error)
        self._failing = True
