"""Messages with documents in, their blocks and faults one by one out."""

from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Iterator

from bml_schema import Block, BMLError, read
from realizer.behaviours import VOCABULARY
from realizer.pipeline import warning_of
from realizer.scheduling.timing import Warning
from realizer.settings import raises

__all__: list[str] = []

log = logging.getLogger(__name__)

# Messages that may wait to be read; a client that sends faster is told.
MOST = 1_000

_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]{1,256})[\"']")


class Inbox:
    """Documents that have come and are not prepared yet.

    Args:
        longest: bytes of BML in a message.
    """

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._unread: deque[Iterator[Block | BMLError]] = deque()

    def __bool__(self) -> bool:
        return bool(self._unread)

    def put(self, text: str) -> Warning | None:
        """Take a message; or say why it is not taken."""
        size = len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
        if len(self._unread) >= MOST:
            words = f"{MOST} messages wait to be read: wanted fewer at a time"
        elif size > self._longest:
            words = f"wanted at most {self._longest} bytes of BML in a message, got {size}"
            words = f"{words} {raises('max_document')}"
        else:
            self._unread.append(read(text, VOCABULARY))
            return None
        return Warning(name_of(text), "PARSING_FAILURE", words)

    def next(self) -> Block | Warning | None:
        """The next block, or why there is none; None where all is read."""
        while self._unread:
            try:
                item = next(self._unread[0], None)
            except Exception:
                log.exception("a document could not be read")
                self._unread.popleft()
                return Warning("<no id>", "PARSING_FAILURE", "internal error while reading")
            if item is not None:
                return item if isinstance(item, Block) else warning_of(item)
            self._unread.popleft()
        return None

    def clear(self) -> None:
        """Nobody wants it any more."""
        self._unread.clear()


def name_of(message: str) -> str:
    """The block id of a document that is not parsed, where it can be read near its start."""
    found = _BLOCK_ID.search(message, 0, 4096)
    return found.group(1) if found else "<no id>"
