"""The journal of a session: its entries, and checkpoints of its state."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING

from realizer.server.journal.checkpoint import Checkpoint
from realizer.server.journal.entry import Entry, Journal, JournalError, Kind, SavedSession, TakenOver

if TYPE_CHECKING:
    from realizer.server.journal.recordings import RecordingFolder

log = logging.getLogger(__name__)

# A checkpoint is due after this many entries, whose replay takes about half a second, or bytes.
ENTRIES = 250
BYTES = 2**20
LONG = 4  # times as many are far too long
# A warning is due after each so many entries, whose replay takes a good part of a minute.
ENDLESS = 10_000
# A checkpoint that failed is due again after so many entries.
AGAIN = 25


class SessionJournal:
    """The journal of a session, from which another process can take the session over, and its recording.

    It writes nowhere until `open`.

    Args:
        on_taken_over: called when another process has taken the session over.
    """

    def __init__(
        self,
        session: str,
        checkpoint: Checkpoint,
        connections: Collection[int],
        on_taken_over: Callable[[TakenOver], None],
    ) -> None:
        self.checkpoint = checkpoint
        self._session = session
        self._connections = connections
        self._on_taken_over = on_taken_over
        self._journal: Journal | None = None
        self._recorder: RecordingFolder | None = None
        self._failing = False
        self._entries = self._bytes = 0

    def open(
        self,
        journal: Journal | None = None,
        recorder: RecordingFolder | None = None,
        *,
        on_stopped: Callable[[], None] = lambda: None,
        follow: Callable[[], bool] = lambda: False,
    ) -> None:
        """Write to a journal and a recording from now on; the next call is `begin` or `resume`.

        Args:
            journal: from which another process can resume the session, or None.
            recorder: of the session for replay, or None. The session does not depend on it.
            on_stopped: called when the recording has failed and stops.
            follow: called after each entry, until it returns False.
        """
        self._journal = journal
        self._recorder = recorder
        self._on_stopped = on_stopped
        self._follow: Callable[[], bool] | None = follow

    def go_on(self, checkpoint: Checkpoint, connections: Collection[int]) -> None:
        """Go on with the parts of a session that were made anew."""
        self.checkpoint, self._connections = checkpoint, connections

    def saved(self) -> SavedSession | None:
        """Return what the journal has of the session; None if it has nothing, or cannot be read."""
        try:
            return None if self._journal is None else self._journal.claim(self._session)
        except JournalError as error:
            log.error("session %s: %s", self._session, error)
            return None

    def leave_out(self, entries: Mapping[int, Entry]) -> None:
        """Replace entries by their index, so that no later replay fails at them."""
        for index, entry in entries.items():
            with contextlib.suppress(JournalError):
                if self._journal is not None:
                    self._journal.replace(self._session, index, entry)

    def begin(self, epoch: float) -> None:
        """Add a new session; raises JournalError if the journal cannot be written."""
        if self._journal is not None:
            self._journal.begin(self._session, epoch)
        self._record(lambda recorder: recorder.begin(self._session, epoch))

    def resume(self, saved: SavedSession) -> None:
        """Continue the journal and the recording of a session that was taken over."""
        self._entries = len(saved.entries)
        self._bytes = sum(len(entry.body) for entry in saved.entries)
        self._record(lambda recorder: recorder.resume(self._session, saved))

    @property
    def needs_checkpoint(self) -> bool:
        """Whether a checkpoint is due."""
        return self._entries >= ENTRIES or self._bytes >= BYTES

    def accept(self, t: float, kind: Kind, connection: int, message: str | bytes) -> str | None:
        """Write a message. Return why it cannot be accepted, or None."""
        try:
            self._append(Entry(t, kind, connection, message))
        except TakenOver as error:
            self._on_taken_over(error)
            return str(error)
        except JournalError as error:
            log.error("session %s: %s", self._session, error)
            return f"this could not be written to the journal, so it is refused: {error}"
        return None

    def note(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write an event that happens anyway. Only the first of several failures is logged.

        Return False if another process has taken over the session.
        """
        entry = Entry(t, kind, number, body)
        try:
            self._append(entry)
        except TakenOver as error:
            self._on_taken_over(error)
            return False
        except JournalError as error:
            self._log_failure(error)
            self._entries = ENTRIES  # a checkpoint makes the missing entry unnecessary
            self._record(lambda recorder: recorder.add(self._session, entry))
        return True

    def compact(self, t: float) -> bool:
        """Replace the journal by a checkpoint if nothing plays. All feedback due by `t` was published.

        Return False if another process has taken over the session. Normally the face must be at rest too. If
        the journal is far too long, this is not required: then a blink or a nod of the next seconds, which
        depends on the last speech, may differ after a takeover.
        """
        is_far_too_long = self._entries >= LONG * ENTRIES or self._bytes >= LONG * BYTES
        if not self.checkpoint.is_possible(t if is_far_too_long else float("-inf")):
            return True
        try:
            parts = self.checkpoint.write(t, self._connections)
            if self._journal is not None:
                self._journal.compact(self._session, parts)
        except TakenOver as error:
            self._on_taken_over(error)
            return False
        except JournalError as error:
            self._log_failure(error)
            self._entries, self._bytes = ENTRIES - AGAIN, 0
        else:
            self._entries = self._bytes = 0
            self.checkpoint.clips.settle()
        return True

    def end(self) -> None:
        """End the session in the journal and the recording."""
        for log_ in (self._journal, self._recorder):
            if log_ is not None:
                log_.end(self._session)

    def _append(self, entry: Entry) -> None:
        if self._journal is not None:
            self._journal.add(self._session, entry)
            self._failing = False
            self._entries += 1
            self._bytes += len(entry.body)
            if self._entries % ENDLESS == 0:
                words = "session %s: no checkpoint after %d entries: some block always plays or waits"
                log.warning(words, self._session, self._entries)
            if self._follow is not None and not self._follow():
                self._follow = None
        self._record(lambda recorder: recorder.add(self._session, entry))

    def _record(self, write: Callable[[RecordingFolder], None]) -> None:
        """Write to the recording. Stop at the first error: a recording with a gap cannot be replayed."""
        if self._recorder is None:
            return
        try:
            write(self._recorder)
        except JournalError as error:
            log.warning("the recording of session %s has stopped: %s", self._session, error)
            self._recorder.end(self._session)
            self._recorder = None
            self._on_stopped()

    def _log_failure(self, error: JournalError) -> None:
        if not self._failing:
            log.error("session %s: %s", self._session, error)
        self._failing = True
