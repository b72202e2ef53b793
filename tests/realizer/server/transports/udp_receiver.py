"""A program that receives packets, and a service that sends them to it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from websockets.asyncio.client import connect

from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.waiting import LIMIT


class Receiver(asyncio.DatagramProtocol):
    """A real UDP socket on loopback.

    Attributes:
        packets: all that it has received, in order.
        address: HOST:PORT.
    """

    def __init__(self) -> None:
        self.packets: list[bytes] = []
        self._news = asyncio.Event()

    async def __aenter__(self) -> Receiver:
        loop = asyncio.get_running_loop()
        self._socket, _ = await loop.create_datagram_endpoint(lambda: self, local_addr=("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._socket.get_extra_info('sockname')[1]}"
        return self

    async def __aexit__(self, *_: object) -> None:
        self._socket.close()

    def datagram_received(self, data: bytes, address: object) -> None:
        self.packets.append(data)
        self._news.set()

    async def until(self, there: Callable[[], bool]) -> None:
        while not there():
            self._news.clear()
            await self._news.wait()


def sending(option: str, test: Callable[[Server, Receiver], Awaitable[None]], **settings: object) -> None:
    """Run a test with a service that sends to a receiver by the transport of that name."""

    async def run() -> None:
        async with asyncio.timeout(LIMIT), Receiver() as receiver:
            chosen = {"voice": "silent", "idle": False, option: receiver.address} | settings
            async with Server(Settings(port=0, **chosen)) as server:  # type: ignore[arg-type]
                await test(server, receiver)

    asyncio.run(run())


def opened(server: Server, session: str | None) -> connect:
    """Return a connection to a session, or to a new one without a name."""
    return connect(server.url + ("" if session is None else f"?session={session}"))


async def answered(client: object, text: str) -> None:
    """Send a message, and return when the service has read it."""
    await client.send(text)  # type: ignore[attr-defined]
    await client.send('{"type":"ping"}')  # type: ignore[attr-defined]
    while '"pong"' not in str(await client.recv()):  # type: ignore[attr-defined]
        pass
