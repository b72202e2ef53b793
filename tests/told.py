"""Feedback of a client of the service, as it was told: up to a point, and its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable

from websockets.asyncio.client import ClientConnection
from websockets.exceptions import ConnectionClosed

__all__ = ["feedback", "numbers"]

SEQ = re.compile(r'seq="(\d+)"')


def numbers(told: Iterable[str]) -> list[int]:
    """The `seq` of each message; each must have one."""
    found = [SEQ.search(text) for text in told]
    assert all(found), "feedback without seq"
    return [int(one[1]) for one in found if one is not None]


async def feedback(client: ClientConnection, last: str) -> list[str]:
    """Feedback up to the progress `last`, or to the end of the connection."""
    told = []
    try:
        async for message in client:
            if isinstance(message, str) and message.startswith("<"):
                told.append(message)
                if f'id="{last}"' in message:
                    break
    except ConnectionClosed:
        pass
    return told
