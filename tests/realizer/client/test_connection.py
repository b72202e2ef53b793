"""The connection of a client: its loss, and messages that it cannot read."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

from realizer.client import ClientError, connect
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, WAIT


@pytest.mark.parametrize(
    "say",
    [
        lambda client: client.send(WAIT.format("b")),
        lambda client: client.play(WAIT.format("b")),
        lambda client: client.control("stop"),
        lambda client: client.ask("ping"),
        lambda client: client.subscribe("fap"),
    ],
)
def test_connection_raises_its_own_error_after_the_end_of_the_connection(say: Any) -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as client:
            await server.close()
            with pytest.raises(ClientError, match="the connection has ended: the service ends") as caught:
                await say(client)
            assert caught.value.code == "connection"

    asyncio.run(run())


def test_connection_raises_to_all_that_wait_if_a_message_is_unreadable() -> None:
    async def answer(socket: ServerConnection) -> None:
        await socket.recv()
        await socket.send('{"type":"welcome","version":1,"session":"a","time":0,"seq":0}')
        await socket.recv()
        await socket.send(b"no frame")
        await socket.wait_closed()

    async def run() -> None:
        async with serve(answer, "127.0.0.1", 0) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            async with connect(f"ws://127.0.0.1:{port}/ws") as client:
                waits = client.frames("fap"), client.feedback(), client.until_end("b")
                tasks = [asyncio.ensure_future(anext(wait)) for wait in waits]
                await client.send(WAIT.format("b"))
                for result in await asyncio.gather(*tasks, return_exceptions=True):
                    assert isinstance(result, ClientError)
                    assert "cannot be read: WireError('wanted a header of 16 bytes" in str(result)

    asyncio.run(asyncio.wait_for(run(), LIMIT))
