"""Feedback in, numbered XML out: what a session keeps for clients that come back."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from bml_schema import Feedback

__all__: list[str] = []

# What is kept in any case, and how many messages at most; of what is older only so many characters.
FRESH = 60.0  # s
MOST = 10_000
ROOM = 2**17


class FeedbackLog:
    """The newest messages of a session, each with its `seq` 1, 2, ...

    Who comes back after a minute finds all that was told since; of what is older some is kept, so that the
    memory of a session that talks for days has a bound.

    Args:
        epoch: POSIX seconds at which the session clock was 0; None where nobody need know.

    Attributes:
        newest: seq of the last message, 0 while there is none.
    """

    def __init__(self, epoch: float | None = None) -> None:
        self.newest = 0
        self._epoch = epoch
        self._kept: deque[tuple[float, str]] = deque()  # (when it was told, its text)
        self._size = 0

    @property
    def first(self) -> int:
        """Seq of the oldest message that is kept; of the next one where none is."""
        return self.newest - len(self._kept) + 1

    def add(self, feedback: Feedback, now: float) -> str:
        """Number a message and keep it; its text.

        Args:
            now: seconds on the session clock.
        """
        self.newest += 1
        text = feedback.to_xml(self.newest, self._epoch)
        self._keep(text, now)
        return text

    def restore(self, newest: int, texts: Iterable[str], now: float) -> None:
        """Have told these messages, the last of which has the number `newest`."""
        self.newest = newest
        for text in texts:
            self._keep(text, now)

    def _keep(self, text: str, now: float) -> None:
        kept = self._kept
        kept.append((now, text))
        self._size += len(text)
        while len(kept) > MOST or (self._size > ROOM and kept[0][0] < now - FRESH):
            self._size -= len(kept.popleft()[1])

    def since(self, seq: int) -> list[str]:
        """The kept messages from `seq` on, in order."""
        count = min(self.newest - seq + 1, len(self._kept))
        return [self._kept[n][1] for n in range(-count, 0)]
