"""What is done to one session in, entries of its journals out."""

from __future__ import annotations

import logging
from collections.abc import Iterable

from realizer.server.journal.entry import Entry, Journal, JournalError, Kind, Lost

__all__ = ["Notes"]

log = logging.getLogger(__name__)


class Notes:
    """The hand that writes for a session.

    Args:
        session: its name.
        journals: where to; none: nothing is kept.
    """

    def __init__(self, session: str, journals: Iterable[Journal] = ()) -> None:
        self._session = session
        self._journals = tuple(journals)
        self._failing = False

    def begin(self, epoch: float) -> None:
        """The session is new.

        Raises:
            JournalError: it cannot be kept.
        """
        for journal in self._journals:
            journal.begin(self._session, epoch)

    def keep(self, at: float, kind: Kind, number: int = 0, body: str | bytes = "") -> None:
        """What must not be done unless it is kept.

        Raises:
            Lost: another process has the session.
            JournalError: it cannot be kept.
        """
        for journal in self._journals:
            journal.add(self._session, Entry(at, kind, number, body))

    def tell(self, at: float, kind: Kind, number: int = 0, body: str | bytes = "") -> None:
        """What happens all the same. A fault is logged once, until it is over.

        Raises:
            Lost: another process has the session.
        """
        try:
            self.keep(at, kind, number, body)
            self._failing = False
        except Lost:
            raise
        except JournalError as error:
            if not self._failing:
                log.error("session %s: %s", self._session, error)
            self._failing = True

    def end(self) -> None:
        """The session is over."""
        for journal in self._journals:
            journal.end(self._session)
