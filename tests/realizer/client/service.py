"""A service for tests of clients."""

from __future__ import annotations

import asyncio
from typing import Any

from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.waiting import LIMIT

WAIT = '<bml id="{}"><wait id="w" duration="0.1"/></bml>'


def serving(test, limit: float = LIMIT, **settings: Any) -> None:
    """Run `test(url)` with a silent service on a free port, for at most `limit` seconds."""

    async def run() -> None:
        wanted = Settings(port=0, voice="silent", **settings)
        async with asyncio.timeout(limit), Server(wanted) as server:
            await test(server.url)

    asyncio.run(run())
