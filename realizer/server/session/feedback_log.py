"""The feedback log of a session: numbered, bounded, resumable."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

from bml_schema import Feedback, parse_feedback

# What is kept in any case, and how many messages at most; of what is older only so many characters.
FRESH = 60.0  # s
MOST = 10_000
ROOM = 2**17
# Messages are much alike: so many characters, once they are not the newest, take a ninth of that together.
PACK = 2**14
# Of what was told, a checkpoint has the last so many messages and characters: minutes of talk. Who comes back
# has the rest already, or is told of a gap.
LAST, LAST_TEXT = 1000, 2**19
BETWEEN = "\0"  # no XML has it


class _Pack(NamedTuple):
    """Messages that belong together, and when the last of them was told."""

    messages: int
    characters: int
    last_time: float
    data: bytes


@dataclass(frozen=True)
class FeedbackFilter:
    """Which feedback a connection gets; the numbers of what it does not get are missing in what it gets.

    Attributes:
        elements: names of feedback elements; None takes all.
        character: of whom; None takes all. What is of no character comes always.
    """

    elements: frozenset[str] | None = None
    character: str | None = None

    def accepts(self, text: str) -> bool:
        """Whether a message is to be sent."""
        if self.elements is not None and text[1:].split(maxsplit=1)[0] not in self.elements:
            return False
        return self.character is None or parse_feedback(text).character_id in (None, self.character)


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
        self._packs: deque[_Pack] = deque()
        self._recent: list[str] = []
        self._unpacked = 0  # characters of these
        self._count = 0  # of all that is kept
        self._size = 0

    @property
    def first(self) -> int:
        """Seq of the oldest message that is kept; of the next one where none is."""
        return self.newest - self._count + 1

    def add(self, feedback: Feedback, now: float) -> str:
        """Number a message and keep it; its text.

        Args:
            now: seconds on the session clock.
        """
        self.newest += 1
        text = feedback.to_xml(self.newest, self._epoch)
        self._store(text, now)
        return text

    def restore(self, newest: int, texts: Iterable[str], now: float) -> None:
        """Have told these messages, the last of which has the number `newest`."""
        self.newest = newest
        for text in texts:
            self._store(text, now)

    def last(self) -> list[str]:
        """Return the newest messages, the oldest first: as many as a checkpoint has room for."""
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
        """Put the older half of what is not packed together."""
        count = size = 0
        while size < PACK:
            size += len(self._recent[count])
            count += 1
        data = zlib.compress(BETWEEN.join(self._recent[:count]).encode(), 1)
        del self._recent[:count]
        self._packs.append(_Pack(count, size, now, data))
        self._unpacked -= size

    def since(self, seq: int) -> list[str]:
        """The kept messages from `seq` on, in order."""
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
