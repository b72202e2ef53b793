"""Reads the feedback that a WebSocket client of the service receives."""

from __future__ import annotations

import re
from collections.abc import Iterable

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

__all__ = ["read_feedback", "seq_numbers"]

SEQ = re.compile(r'seq="(\d+)"')


def seq_numbers(messages: Iterable[str]) -> list[int]:
    """Return the `seq` of each message; fail if one has none."""
    found = [SEQ.search(text) for text in messages]
    assert all(found), "feedback without seq"
    return [int(match[1]) for match in found if match is not None]


async def read_feedback(client: ClientConnection, last: str) -> list[str]:
    """Return the feedback up to the progress with the id `last`, or to the end of the connection."""
    messages = []
    try:
        async for message in client:
            if isinstance(message, str) and message.startswith("<"):
                messages.append(message)
                if f'id="{last}"' in message:
                    break
    except ConnectionClosed:
        pass
    return messages
