"""The journal of a session: its events, and checkpoints of its state."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection

from realizer.server.journal.checkpoint import Checkpoint
from realizer.server.journal.entry import JournalError, Kind, TakenOver
from realizer.server.journal.journal_writer import JournalWriter

log = logging.getLogger(__name__)


class SessionJournal:
    """The journal of a session, from which another process can take the session over.

    Args:
        session: the session's name.
        checkpoint: reads and writes the session's state.
        connections: the ids of its connections.
        on_taken_over: called when another process has taken the session over.

    Attributes:
        writer: writes the entries; at first nowhere.
    """

    def __init__(
        self,
        session: str,
        checkpoint: Checkpoint,
        connections: Collection[int],
        on_taken_over: Callable[[TakenOver], None],
    ) -> None:
        self.writer = JournalWriter(session)
        self._session = session
        self._checkpoint = checkpoint
        self._connections = connections
        self._on_taken_over = on_taken_over

    def accept(self, t: float, kind: Kind, connection: int, message: str | bytes) -> str | None:
        """Write a message. Return why it cannot be accepted, or None."""
        try:
            self.writer.append(t, kind, connection, message)
        except TakenOver as error:
            self._on_taken_over(error)
            return str(error)
        except JournalError as error:
            log.error("session %s: %s", self._session, error)
            return f"this could not be written to the journal, so it is refused: {error}"
        return None

    def note(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write an event. Return False if another process has taken over the session."""
        try:
            self.writer.try_append(t, kind, number, body)
        except TakenOver as error:
            self._on_taken_over(error)
            return False
        return True

    def compact(self, t: float) -> bool:
        """Replace the journal by a checkpoint if nothing plays. All feedback due by `t` was published.

        Return False if another process has taken over the session. Normally the face must be at rest too. If
        the journal is far too long, this is not required: then a blink or a nod of the next seconds, which
        depends on the last speech, may differ after a takeover.
        """
        if not self._checkpoint.is_possible(t if self.writer.is_far_too_long else float("-inf")):
            return True
        try:
            if self.writer.compact(self._checkpoint.write(t, self._connections)):
                self._checkpoint.clips.settle()
        except TakenOver as error:
            self._on_taken_over(error)
            return False
        return True
