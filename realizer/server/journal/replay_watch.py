"""Notes about a replay: which document is worked on, in case the process dies or stalls there."""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from realizer.server.journal.entry import NOTE, Entry
from realizer.server.session.session import Session

TRIES = 2  # a document whose replay was begun so often, and never ended, is put aside
STALLS = 10.0  # s; a document that takes longer stalls its replay


@dataclass(frozen=True, slots=True)
class ReplayNote:
    """A note in the journal about the document that a replay works on.

    Attributes:
        entry: its index among the entries.
        begun: how many replays have begun it without an end.
    """

    entry: int
    begun: int

    def text(self) -> str:
        """Return the part of the journal."""
        return json.dumps({"entry": self.entry, "begun": self.begun})

    @classmethod
    def read(cls, parts: Mapping[str, str]) -> "ReplayNote | None":
        """Return the note in the parts of a journal, or None."""
        try:
            data = json.loads(parts[NOTE])
            return cls(int(data["entry"]), int(data["begun"]))
        except (KeyError, TypeError, ValueError):
            return None


class ReplayWatch:
    """Notes in the journal which document a session works on until it has planned all of the journal's.

    Args:
        write: stores the text of a note, or deletes it (None).
        last: the note that the replay before left behind.
        clock: seconds.
    """

    def __init__(
        self,
        write: Callable[[str | None], None],
        last: ReplayNote | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.write = write
        self._last = last
        self._clock = clock
        self._since = 0.0  # when the document was noted
        self._session: Session | None = None
        self._noted: int | None = None
        self._entries: dict[int, int] = {}  # number of a message with documents -> index of its entry

    def before(self, session: Session, index: int, entry: Entry) -> None:
        """Note the document that the session works on when it takes an entry: an earlier one, or this."""
        self._session = session
        if entry.kind == "text":
            self._entries[session.submission.queue.received + 1] = index
        if (unfinished := self._unfinished()) is not None:
            self._note(unfinished)
        elif entry.kind == "text":
            self._note(index)

    def follow(self) -> bool:
        """Note the document that is worked on next. Return False if those of the journal are all planned."""
        unfinished = self._unfinished()
        self._note(unfinished)
        return unfinished is not None

    def withdraw(self, write: Callable[[str | None], None]) -> None:
        """Withdraw the note, because the process ends in order; unless the document has stalled the replay.

        Args:
            write: as for the class.
        """
        if self._noted is not None and self._clock() - self._since < STALLS:
            write(None if self._last is None else self._last.text())

    def _unfinished(self) -> int | None:
        """Return the entry of the first document that is not planned and does not wait for a client."""
        if self._session is None or self._session.closed:
            return None
        submission = self._session.submission
        messages = [
            pending.message
            for pending in submission.pending.blocks
            if not (pending.is_streaming or pending.is_incomplete(pending.block))
        ]
        messages += [submission.queue.message] if submission.queue else []
        return next((self._entries[number] for number in messages if number in self._entries), None)

    def _note(self, index: int | None) -> None:
        if index == self._noted:
            return
        self._noted, self._since = index, self._clock()
        if index is None:
            self.write(None)
            return
        last = self._last
        begun = last.begun if last is not None and last.entry == index else 0
        self.write(ReplayNote(index, begun + 1).text())
