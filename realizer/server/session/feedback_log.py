"""The feedback log of a session: numbered, bounded, resumable."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

from bml_schema import Feedback, parse_feedback

FRESH = 60.0  # s; newer messages are kept, unless there are more than MOST
MOST = 10_000  # messages
ROOM = 2**17  # characters of older messages
# Messages are much alike: packs of so many characters are compressed to a ninth.
PACK = 2**14
# A checkpoint contains at most so many messages and characters: some minutes of talk. A client that resumes
# has the rest already, or gets `gap`.
LAST, LAST_TEXT = 1000, 2**19
BETWEEN = "\0"  # not allowed in XML


class _Pack(NamedTuple):
    """Compressed messages, and the time of the last of them."""

    messages: int
    characters: int
    last_time: float
    data: bytes


@dataclass(frozen=True)
class FeedbackFilter:
    """A filter of the feedback for one connection. Messages keep their numbers, so there are gaps.

    Attributes:
        elements: names of feedback elements; None accepts all.
        character: id of a character; None accepts all. Feedback without a character is always accepted.
    """

    elements: frozenset[str] | None = None
    character: str | None = None

    def accepts(self, text: str) -> bool:
        """Whether the filter lets a message pass."""
        if self.elements is not None and text[1:].split(maxsplit=1)[0] not in self.elements:
            return False
        return self.character is None or parse_feedback(text).character_id in (None, self.character)


class FeedbackLog:
    """The newest messages of a session, numbered by `seq` 1, 2, ...

    A client that resumes within a minute gets all that it missed. Of older messages only some are kept, so
    that the memory of a long session is bounded.

    Args:
        epoch: POSIX seconds at which the session clock was 0; None leaves them out of messages.

    Attributes:
        newest: seq of the last message, 0 before the first.
    """

    def __init__(self, epoch: float | None = None) -> None:
        self.newest = 0
        self._epoch = epoch
        self._packs: deque[_Pack] = deque()
        self._recent: list[str] = []
        self._unpacked = 0  # characters of `_recent`
        self._count = 0  # stored messages
        self._size = 0  # their characters

    @property
    def first(self) -> int:
        """Seq of the oldest stored message; of the next message if none is stored."""
        return self.newest - self._count + 1

    def add(self, feedback: Feedback, now: float) -> str:
        """Number and store a message, and return its text.

        Args:
            now: seconds on the session clock.
        """
        self.newest += 1
        text = feedback.to_xml(self.newest, self._epoch)
        self._store(text, now)
        return text

    def restore(self, newest: int, texts: Iterable[str], now: float) -> None:
        """Fill the log with messages, the last of which has the number `newest`."""
        self.newest = newest
        for text in texts:
            self._store(text, now)

    def last(self) -> list[str]:
        """Return the newest messages for a checkpoint, the oldest first."""
        found: list[str] = []
        size = 0
        for text in reversed(self.since(self.newest - LAST + 1)):
            size += len(text)
            if size > LAST_TEXT:
                break
            found.append(text)
        return found[::-1]

    def _store(self, text: str, now: float) -> None:
        self._recent.append(text)
        self._count += 1
        self._size += len(text)
        self._unpacked += len(text)
        if self._unpacked > 2 * PACK:
            self._pack(now)
        packs = self._packs
        while packs and (self._count > MOST or (self._size > ROOM and packs[0].last_time < now - FRESH)):
            self._count -= packs[0].messages
            self._size -= packs.popleft().characters

    def _pack(self, now: float) -> None:
        """Compress the older half of the recent messages."""
        count = size = 0
        while size < PACK:
            size += len(self._recent[count])
            count += 1
        data = zlib.compress(BETWEEN.join(self._recent[:count]).encode(), 1)
        del self._recent[:count]
        self._packs.append(_Pack(count, size, now, data))
        self._unpacked -= size

    def since(self, seq: int) -> list[str]:
        """Return the stored messages from `seq` on, in order."""
        wanted = min(self.newest - seq + 1, self._count)
        if wanted <= len(self._recent):
            return self._recent[len(self._recent) - wanted :] if wanted > 0 else []
        missing, packs = wanted - len(self._recent), []
        for pack in reversed(self._packs):
            if missing <= 0:
                break
            packs.append(zlib.decompress(pack.data).decode().split(BETWEEN))
            missing -= pack.messages
        return list(chain(*reversed(packs), self._recent))[-wanted:]
