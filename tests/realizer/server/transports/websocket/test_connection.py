"""WebSocket connections: admission, logs, frames and the end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from realizer.core.settings import Settings
from realizer.server.journal import JournalError
from realizer.server.serve import Server
from realizer.server.transports.websocket.connection import WebSocketClient

LIMIT = 30  # s
TOKEN = "a-token-of-many-letters-and-0123456789"


def closed(url: str, *messages: str, **settings: object) -> tuple[list[str], int, str]:
    """Return the answers to a client whose first messages are these, and the code and reason of the close."""

    async def run() -> tuple[list[str], int, str]:
        received: list[str] = []
        here = Settings(port=0, voice="silent", **settings)  # type: ignore[arg-type]
        async with asyncio.timeout(LIMIT), Server(here) as server, connect(server.url + url) as client:
            for message in messages:
                await client.send(message)
            with contextlib.suppress(ConnectionClosed):
                while True:
                    received.append(str(await client.recv()))
        return received, client.close_code or 0, client.close_reason or ""

    return asyncio.run(run())


def test_connection_says_what_it_wanted_before_a_token() -> None:
    (error,), code, reason = closed("?session=s", '{"type": "ping"}', token=TOKEN)
    assert (json.loads(error)["code"], json.loads(error)["where"]) == ("token", "hello.token")
    assert code == 1008
    assert reason.startswith("token: wanted")


def test_connection_asks_to_come_again_if_a_session_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: object, session: str) -> None:
        raise JournalError("the disk does not answer")

    monkeypatch.setattr("realizer.server.journal.sqlite_journal.SqliteJournal.claim", broken)
    received, code, reason = closed("?session=s", journal=str(tmp_path / "journal.db"))
    assert (received, code, reason) == ([], 1013, "the disk does not answer")


def test_connection_logs_its_begin_and_end(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        here = Settings(port=0, voice="silent")
        async with (
            asyncio.timeout(LIMIT),
            Server(here) as server,
            connect(f"{server.url}?session=show") as client,
        ):
            await client.send('{"type": "ping"}')
            await client.recv()
            await client.close()

    with caplog.at_level(logging.INFO, "realizer.server.transports.websocket.connection"):
        asyncio.run(run())
    joined, left = (r for r in caplog.records if r.name == "realizer.server.transports.websocket.connection")
    assert (joined.message, left.message) == ("joined", "left")
    assert (joined.session, joined.address) == ("show", "127.0.0.1")  # type: ignore[attr-defined]
    assert (left.session, left.code) == ("show", 1000)  # type: ignore[attr-defined]


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


def test_writer_sends_messages_of_any_length_whole_and_in_order() -> None:
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


def test_writer_is_not_disturbed_by_frames_of_the_library() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.send("one")
        assert await asyncio.wait_for(await theirs.ping(), LIMIT) >= 0
        client.send(b"two")
        assert [await theirs.recv(), await theirs.recv()] == ["one", b"two"]

    between(test)


def test_writer_sends_nothing_after_the_end() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.send("last")
        client.disconnect(1013, "enough")
        client.send("too late")
        client.disconnect(1011, "a second end")
        assert await theirs.recv() == "last"
        with pytest.raises(ConnectionClosed) as closed:
            await theirs.recv()
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "enough")
        client.send("to nobody")
        assert client.unsent_bytes == 0

    between(test)


def test_writer_counts_what_is_not_read() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        theirs.transport.pause_reading()
        while client.unsent_bytes < 100_000:
            client.send(bytes(1_000_000))
            await asyncio.sleep(0)
        theirs.transport.resume_reading()
        while client.unsent_bytes:
            assert len(await theirs.recv()) == 1_000_000

    between(test)


def test_writer_cuts_a_long_reason() -> None:
    async def test(client: WebSocketClient, theirs: ClientConnection) -> None:
        client.disconnect(1013, "é" * 100)  # two bytes each, and room for 123
        with pytest.raises(ConnectionClosed) as closed:
            await theirs.recv()
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "é" * 61)

    between(test)
