"""The base of transports that are clients of another program."""

import asyncio
import contextlib
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable

log = logging.getLogger(__name__)

FIRST_RETRY = 0.2  # s
LAST_RETRY = 10.0  # s


class ReconnectingTransport(ABC):
    """A transport that connects to another program, and connects again when the connection is lost.

    Args:
        peer: HOST:PORT of the program.
    """

    def __init__(self, name: str, peer: str) -> None:
        host, _, port = peer.rpartition(":")
        self._address = (host.strip("[]"), int(port))
        self._name = name
        self._peer = peer
        self._up = asyncio.Event()
        self._keeper: asyncio.Task[None] | None = None

    async def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._keeper = self._loop.create_task(self._keep_connected())

    async def ready(self) -> None:
        await self._up.wait()

    def stop_accepting(self) -> None:
        """Go on: what plays is shown to its end, and sessions refuse documents themselves."""
        return

    async def close(self) -> None:
        if self._keeper is not None:
            self._keeper.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._keeper

    @abstractmethod
    async def _serve(self, connected: Callable[[], None]) -> str:
        """Connect, call `connected`, serve until the connection is lost, and return the reason."""

    async def _keep_connected(self) -> None:
        """Serve until cancelled. Only the first of several failures is logged."""
        pause, logged = FIRST_RETRY, False

        def connected() -> None:
            nonlocal pause, logged
            level = logging.WARNING if logged else logging.INFO
            log.log(level, "%s: connected to %s", self._name, self._peer)
            pause, logged = FIRST_RETRY, False

        while True:
            reason = await self._serve(connected)
            if not logged:
                log.warning("%s: %s; looking for it", self._name, reason)
                logged = True
            await asyncio.sleep(pause)
            pause = min(2 * pause, LAST_RETRY)
