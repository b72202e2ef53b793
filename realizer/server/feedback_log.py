"""Feedback in, numbered XML out: what a session keeps for clients that come back."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from itertools import islice

from bml_schema import Feedback, parse_feedback

__all__: list[str] = []


class FeedbackLog:
    """The newest messages of a session, each with its `seq` 1, 2, ...

    Args:
        keep: how many are kept; None: all.
        epoch: POSIX seconds at which the session clock was 0; None where nobody need know.

    Attributes:
        newest: seq of the last message, 0 while there is none.
    """

    def __init__(self, keep: int | None, epoch: float | None = None) -> None:
        self.newest = 0
        self._epoch = epoch
        self._kept: deque[tuple[Feedback, str]] = deque(maxlen=keep)

    @property
    def first(self) -> int:
        """Seq of the oldest message that is kept; of the next one where none is."""
        return self.newest - len(self._kept) + 1

    def add(self, feedback: Feedback) -> None:
        """Number a message and keep it."""
        self.newest += 1
        self._kept.append((feedback, feedback.to_xml(self.newest, self._epoch)))

    def restore(self, newest: int, texts: Iterable[str]) -> None:
        """Have told these messages, the last of which has the number `newest`."""
        self.newest = newest
        self._kept.extend((parse_feedback(text), text) for text in texts)

    def since(self, seq: int) -> list[tuple[Feedback, str]]:
        """The kept messages from `seq` on, in order, each with its text."""
        skipped = max(0, seq - self.first)
        return list(islice(self._kept, skipped, None))
