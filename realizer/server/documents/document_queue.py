"""The queue of received texts, parsed one document at a time."""

from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from bml_schema import Block, BMLError, BMLSizeError, read
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings, raises
from realizer.pipeline import warning_of
from realizer.scheduling.timing import Warning
from realizer.server.documents.limits import too_large

log = logging.getLogger(__name__)

_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]{1,256})[\"']")


@dataclass(frozen=True, slots=True)
class Stopped:
    """A block that somebody stopped after it had come and before it was read."""

    block: Block


class Inbox:
    """Documents that have come and are not prepared yet: no more messages than blocks may wait."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._unread: deque[Iterator[Block | BMLError]] = deque()
        self._came = 0  # so many messages
        self._all_stopped = 0  # every block up to that message
        self._stopped: dict[str, int] = {}  # a block -> if it is in a message up to that one

    def __bool__(self) -> bool:
        return bool(self._unread)

    def put(self, text: str) -> Warning | None:
        """Take a message; or say why it is not taken."""
        limits = self._settings
        if len(self._unread) >= limits.max_blocks:
            words = f"{limits.max_blocks} messages wait to be read: wanted fewer at a time"
            return Warning(name_of(text), "PARSING_FAILURE", f"{words} {raises('max_blocks')}")
        if (beyond := too_large(text, limits)) is not None:
            return Warning(name_of(text), "PARSING_FAILURE", beyond)
        found = read(text, VOCABULARY, most_bytes=limits.max_document, most_behaviours=limits.max_behaviours)
        self._unread.append(found)
        self._came += 1
        return None

    def stop(self, blocks: Iterable[str] | None) -> None:
        """Let none of these, or of all (None), play that have come so far and are not read."""
        if not self._unread:
            return
        if blocks is None:
            self._all_stopped = self._came
        else:
            self._stopped |= dict.fromkeys(blocks, self._came)

    def next(self) -> Block | Stopped | Warning | None:
        """The next block, or why there is none; None where all is read."""
        while self._unread:
            try:
                item = next(self._unread[0], None)
            except Exception:
                log.exception("a document could not be read")
                self._unread.popleft()
                return Warning("<no id>", "PARSING_FAILURE", "internal error while reading")
            if isinstance(item, Block):
                number = self._came - len(self._unread) + 1
                stopped = number <= max(self._all_stopped, self._stopped.get(item.id, 0))
                return Stopped(item) if stopped else item
            if item is not None:
                refused = warning_of(item)
                if isinstance(item, BMLSizeError):  # of behaviours: the bytes were counted before
                    refused = replace(refused, text=f"{refused.text} {raises('max_behaviours')}")
                return refused
            self._unread.popleft()
        self._stopped.clear()
        return None

    def clear(self) -> None:
        """Nobody wants it any more."""
        self._unread.clear()


def name_of(message: str) -> str:
    """The block id of a document that is not parsed, where it can be read near its start."""
    found = _BLOCK_ID.search(message, 0, 4096)
    return found.group(1) if found else "<no id>"
