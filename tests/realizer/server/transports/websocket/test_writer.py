"""What is handed to a WebSocket comes out at its other end, whole and in order, and nobody waits for it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from realizer.server.transports.websocket.writer import WebSocketClient

LIMIT = 30  # s; a hung test ends


def between(test: Callable[[WebSocketClient, ClientConnection], Awaitable[None]]) -> None:
    """Run a test with both ends of a connection."""

    async def run() -> None:
        ours: asyncio.Future[ServerConnection] = asyncio.get_running_loop().create_future()

        async def handle(connection: ServerConnection) -> None:
            ours.set_result(connection)
            await connection.wait_closed()

        async with asyncio.timeout(LIMIT), serve(handle, "127.0.0.1", 0, compression=None) as server:
            port = server.sockets[0].getsockname()[1]
            async with connect(f"ws://127.0.0.1:{port}", max_size=None, max_queue=None) as theirs:
                await test(WebSocketClient(await ours), theirs)

    asyncio.run(run())


def test_messages_of_any_length_come_whole_and_in_order() -> None:
    sent: list[str | bytes] = []
    for length in (0, 1, 125, 126, 127, 65_535, 65_536, 200_000):
        sent += [
            "é" * (length // 2) + "x" * (length % 2),
            bytes(range(256)) * (length // 256) + bytes(length % 256),
        ]

    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        for message in sent:
            client.send(message)
        assert [await theirs.recv() for _ in sent] == sent

    between(test)


def test_what_the_package_sends_in_between_disturbs_nothing() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.send("one")
        assert await asyncio.wait_for(await theirs.ping(), LIMIT) >= 0
        client.send(b"two")
        assert [await theirs.recv(), await theirs.recv()] == ["one", b"two"]

    between(test)


def test_after_the_end_nothing_more_is_sent() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.send("last")
        client.end(1013, "enough")
        client.send("too late")
        client.end(1011, "a second end")
        assert await theirs.recv() == "last"
        with pytest.raises(ConnectionClosed) as closed:
            await theirs.recv()
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "enough")
        client.send("to nobody")
        assert client.waiting == 0

    between(test)


def test_what_is_not_read_waits_and_is_counted() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        theirs.transport.pause_reading()
        while client.waiting < 100_000:
            client.send(bytes(1_000_000))
            await asyncio.sleep(0)
        theirs.transport.resume_reading()
        while client.waiting:
            assert len(await theirs.recv()) == 1_000_000

    between(test)


def test_of_a_long_reason_is_told_what_there_is_room_for() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.end(1013, "é" * 100)  # two bytes each, and room for 123
        with pytest.raises(ConnectionClosed) as closed:
            await theirs.recv()
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "é" * 61)

    between(test)
