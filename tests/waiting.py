"""Waiting for what must happen: a test that waits in vain ends, and no test asserts a time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

__all__ = ["LIMIT", "wait_for"]

# s, many times what any wait takes. pytest's own limit is longer, so that a test ends what it has started.
LIMIT = 240


async def wait_for(condition: Callable[[], object]) -> None:
    """Wait until a condition holds whose beginning nothing announces."""
    async with asyncio.timeout(LIMIT):
        while not condition():
            await asyncio.sleep(0.01)
