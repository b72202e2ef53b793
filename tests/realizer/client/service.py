"""A service for tests of clients."""

from __future__ import annotations

import asyncio
from typing import Any

from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests import virtual_time
from tests.waiting import LIMIT

WAIT = '<bml id="{}"><wait id="w" duration="0.1"/></bml>'


def serving(test, limit: float = LIMIT, real_time: bool = False, **settings: Any) -> None:
    """Run `test(url)` with a silent service on a free port, for at most `limit` seconds.

    Args:
        real_time: for clients in threads or processes of their own, of which a virtual clock knows nothing.
    """

    async def run() -> None:
        wanted = Settings(port=0, voice="silent", **settings)
        async with asyncio.timeout(limit), Server(wanted) as server:
            await test(server.url)

    (asyncio.run if real_time else virtual_time.run)(run())
