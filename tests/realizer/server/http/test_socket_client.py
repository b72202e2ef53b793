"""A WebSocket of an ASGI server: an application that shows what its client does."""

from __future__ import annotations

import contextlib

from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from realizer.core.settings import Settings
from realizer.server.http.socket_client import SocketClient
from tests.realizer.server.http.conftest import LIMIT


def talk(serve, act, settings=None):
    """Run `act(client)` in an application; return its result, and what the other end got until the close."""
    results = []

    async def endpoint(socket) -> None:
        await socket.accept()
        client = SocketClient(socket, "/ws", "here", settings or Settings())
        results.append(await act(client))
        await client.close(1000, "")
        await client.finish()

    got = []
    with (
        serve(Starlette(routes=[WebSocketRoute("/", endpoint)])) as served,
        connect(served.url.replace("http", "ws"), open_timeout=LIMIT, max_size=None) as socket,
    ):
        with contextlib.suppress(ConnectionClosed):  # the application may not wait for them
            socket.send("one")
            socket.send(b"two")
        try:
            while True:
                got.append(socket.recv(LIMIT))
        except ConnectionClosed as closed:
            end = closed.rcvd
    return results[0], got, end


def test_client_receives_texts_and_bytes(serve) -> None:
    async def act(client):
        return [await client.receive(), await client.receive()]

    assert talk(serve, act)[0] == ["one", b"two"]


def test_client_sends_in_order_what_waits_at_its_end(serve) -> None:
    async def act(client):
        for k in range(50):
            client.send(f"{k}" if k % 2 else bytes([k]))
        return client.unsent_bytes

    unsent, got, _ = talk(serve, act)
    assert unsent > 0
    assert got == [f"{k}" if k % 2 else bytes([k]) for k in range(50)]


def test_client_send_all_waits_for_the_network(serve) -> None:
    async def act(client):
        await client.send_all("x" * 100_000)
        return client.unsent_bytes

    assert talk(serve, act)[0] == 0


def test_client_disconnect_says_why_and_sends_no_more(serve) -> None:
    async def act(client):
        client.send("last")
        client.disconnect(1013, "é" * 100)
        client.send("too late")
        await client._end

    _, got, closed = talk(serve, act)
    assert got == ["last"]
    assert (closed.code, closed.reason) == (1013, "é" * 61)


def test_client_refuses_a_message_that_is_too_long(serve) -> None:
    async def act(client):
        return await client.receive()

    received, _, closed = talk(serve, act, Settings(max_message=2))
    assert received is None
    assert (closed.code, closed.reason[:34]) == (1009, "wanted messages of at most 2 bytes")


def test_client_says_when_it_is_sent_too_much(serve) -> None:
    async def act(client):
        notices = []
        client.on_rate(notices.append)
        return [await client.receive(), await client.receive(), notices]

    *_, notices = talk(serve, act, Settings(max_rate=0.5))[0]
    assert "wanted at most 0.5 messages a second" in notices[0]
