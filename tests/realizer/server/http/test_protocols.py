"""Requests by other methods, and bytes that are no request, at the real transport."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from realizer.core.settings import Settings
from realizer.server.http import protocols
from realizer.server.http.protocols import SLICE
from realizer.server.http.socket_client import SocketClient
from realizer.server.serve import Server
from tests.waiting import LIMIT


def answers(*requests: bytes) -> list[bytes]:
    """Return what the service answers to each request on a connection of its own."""

    async def ask(port: int, request: bytes) -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for part in (request[:2], request[2:]):
            writer.write(part)
            await writer.drain()
        answer = await reader.read()
        writer.close()
        return answer

    async def run() -> list[bytes]:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            return [await ask(server.port, request) for request in requests]

    return asyncio.run(run())


def request(method: str, target: str = "/", body: str = "") -> bytes:
    head = f"{method} {target} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
    head += f"Content-Length: {len(body)}\r\n\r\n"
    return (head + body).encode()


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "PATCH", "POST", "TRACE"])
def test_protocol_refuses_other_methods(method: str) -> None:
    (answer,) = answers(request(method))
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 405 ")
    assert set(re.search(rb"\r\nallow: (.*)", head)[1].strip().split(b", ")) == {b"GET", b"HEAD"}  # type: ignore[index]
    assert body == f"wanted GET or HEAD /, got {method}\n".encode()


def test_protocol_answers_head_as_get_without_the_body() -> None:
    for path, status in (("/healthz", b"200"), ("/nothing", b"404")):
        asked, got = answers(request("HEAD", path), request("GET", path))
        head, blank, body = got.partition(b"\r\n\r\n")
        assert body
        assert head.startswith(b"HTTP/1.1 " + status)
        lines = {line for line in asked.split(b"\r\n") if not line.startswith(b"date")}
        assert lines - {b""} <= set(head.split(b"\r\n"))
        assert asked.endswith(blank)


def test_protocol_keeps_a_connection_for_further_requests() -> None:
    kept = request("GET", "/healthz").replace(b"Connection: close\r\n", b"")
    (answer,) = answers(kept + kept + request("GET", "/healthz"))
    assert answer.count(b"HTTP/1.1 200 ") == 3


def test_protocol_answers_what_is_no_request() -> None:
    for answer in answers(
        b"GET /\xe9 HTTP/1.1\r\n\r\n",
        b"\x16\x03\x01\x02\0\r\n\r\n",
    ):
        assert answer.startswith(b"HTTP/1.1 400 ")


def test_protocol_answers_a_get_that_comes_in_parts() -> None:
    (answer,) = answers(request("GET", "/healthz"))
    assert answer.startswith(b"HTTP/1.1 200 ")


@settings(max_examples=10, deadline=None)
@given(st.lists(st.binary(max_size=40) | st.text("/%.?[]:#@", max_size=20).map(str.encode), min_size=40))
def test_protocol_answers_any_bytes_without_an_error(targets: list[bytes]) -> None:
    for answer in answers(
        *(b"GET /" + t + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n" for t in targets)
    ):
        assert re.match(rb"HTTP/1\.1 [24]\d\d ", answer)


UPGRADE = (
    b"GET /ws HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
MASK = b"\x80\0\0\0\0"  # of an empty frame
FLOODS = {"pong": b"\x8a" + MASK, "ping": b"\x89" + MASK, "fragment": b"\x00" + MASK}


def flooded(flood: bytes, **settings: Any) -> dict[str, float]:
    """Return the metrics when a flood has exceeded the rate, and another client has got its pong."""

    async def run() -> dict[str, float]:
        here = Settings(port=0, voice="silent", max_rate=10, **settings)
        async with asyncio.timeout(LIMIT), Server(here) as server:
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(UPGRADE)
            assert (await reader.readuntil(b"\r\n\r\n")).startswith(b"HTTP/1.1 101 ")
            writer.write(flood)
            await writer.drain()
            async with connect(f"{server.url}?token=a-word") as neighbour:
                await neighbour.send(json.dumps({"type": "ping", "id": "x"}))
                assert json.loads(await neighbour.recv())["id"] == "x"
            while "rate_exceeded_total 0.0" in (text := server._sessions.metrics_text()):
                await asyncio.sleep(0)
            writer.transport.abort()
        return {name: float(value) for name, value in re.findall(r"^realizer_(\w+) (\S+)$", text, re.M)}

    return asyncio.run(run())


@pytest.mark.parametrize("token", [None, "a-word"])
@pytest.mark.parametrize("kind", ["ping", "pong"])
def test_connection_reads_a_flood_of_control_frames_slowly(kind: str, token: str | None) -> None:
    counts = flooded(100_000 * FLOODS[kind], token=token)
    # Those of a slice, and the neighbour's close frame.
    assert 0 < counts["control_frames_total"] <= SLICE / len(FLOODS[kind]) + 2
    assert counts["rate_exceeded_total"] == 1


def test_connection_reads_a_flood_of_empty_fragments_slowly() -> None:
    counts = flooded(b"\x01" + MASK + 100_000 * FLOODS["fragment"])
    assert counts["rate_exceeded_total"] == 1
    assert counts["messages_total"] == 1  # of the neighbour


def test_connection_counts_the_bytes_of_a_large_message() -> None:
    head = b"\x82\xff" + (2**20).to_bytes(8, "big") + bytes(4)
    assert flooded(head + bytes(2**20))["rate_exceeded_total"] == 1


def test_connection_reads_large_messages_whole() -> None:
    async def run() -> None:
        here = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(here) as server, connect(server.url) as socket:
            for size in (SLICE - 100, 3 * SLICE, 100_000):
                await socket.send(json.dumps({"type": "ping", "id": size * "x"}))
                assert len(json.loads(await socket.recv())["id"]) == size

    asyncio.run(run())


def test_protocol_counts_errors_of_requests() -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            for method, status in (("POST", b" 405 "), ("GET", b" 404 "), ("\x01", b" 400 ")):
                reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
                writer.write(request(method, "/nothing"))
                assert status in await reader.readline()
                writer.close()
            text = server._sessions.metrics_text()
        assert "realizer_http_errors_total 3.0\n" in text
        assert "realizer_http_failures_total 0.0\n" in text

    asyncio.run(run())


def between(test: Callable[[SocketClient, ClientConnection], Awaitable[None]]) -> None:
    """Run a test with both ends of a connection."""

    async def run() -> None:
        ours = asyncio.get_running_loop().create_future()

        async def serve(client: SocketClient) -> None:
            ours.set_result(client)
            while await client.receive() is not None:
                pass

        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            server._hub.connections.serve = serve  # type: ignore[method-assign]
            async with connect(server.url, max_size=None, max_queue=None) as theirs:
                await test(await ours, theirs)

    asyncio.run(run())


def test_writer_sends_messages_of_any_length_whole_and_in_order() -> None:
    sent: list[str | bytes] = []
    for length in (0, 1, 125, 126, 127, 65_535, 65_536, 200_000):
        sent += [
            "é" * (length // 2) + "x" * (length % 2),
            bytes(range(256)) * (length // 256) + bytes(length % 256),
        ]

    async def test(client: SocketClient, theirs: ClientConnection) -> None:
        for message in sent:
            client.send(message)
        assert [await theirs.recv() for _ in sent] == sent

    between(test)


def test_writer_is_not_disturbed_by_frames_of_the_library() -> None:
    async def test(client: SocketClient, theirs: ClientConnection) -> None:
        client.send("one")
        assert await asyncio.wait_for(await theirs.ping(), LIMIT) >= 0
        client.send(b"two")
        assert [await theirs.recv(), await theirs.recv()] == ["one", b"two"]

    between(test)


def test_writer_sends_nothing_after_the_end() -> None:
    async def test(client: SocketClient, theirs: ClientConnection) -> None:
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
    async def test(client: SocketClient, theirs: ClientConnection) -> None:
        theirs.transport.pause_reading()
        while client.unsent_bytes < 100_000:
            client.send(bytes(1_000_000))
            await asyncio.sleep(0)
        theirs.transport.resume_reading()
        while client.unsent_bytes:
            assert len(await theirs.recv()) == 1_000_000

    between(test)


def test_writer_cuts_a_long_reason() -> None:
    async def test(client: SocketClient, theirs: ClientConnection) -> None:
        client.disconnect(1013, "é" * 100)  # two bytes each, and room for 123
        with pytest.raises(ConnectionClosed) as closed:
            await theirs.recv()
        assert closed.value.rcvd is not None
        assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "é" * 61)

    between(test)


def test_protocol_logs_no_error_for_a_websocket_that_is_refused(caplog: pytest.LogCaptureFixture) -> None:
    (answer,) = answers(UPGRADE.replace(b"/ws", b"/ws?session=a%20b"))
    assert answer.startswith(b"HTTP/1.1 400 ")
    assert not [record for record in caplog.records if record.levelname == "ERROR"]


def test_connection_ends_if_its_request_does_not_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocols, "OPENING", 0.1)
    for part in (b"", b"GET / HT", b"GET /healthz HTTP/1.1\r\nHost: x\r\n"):
        assert answers(part) == [b""]


def test_connection_ends_if_its_answer_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocols, "OPENING", 0.2)

    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            _, writer = await asyncio.open_connection("127.0.0.1", server.port, limit=1000)
            writer.transport.pause_reading()  # type: ignore[attr-defined]
            writer.write(8 * request("GET", "/faces/ada").replace(b"Connection: close\r\n", b""))
            while not server._web._connections:
                await asyncio.sleep(0)
            await next(iter(server._web._connections)).closed.wait()
            writer.transport.abort()

    asyncio.run(run())


@pytest.mark.parametrize(("size", "is_read"), [(1, False), (8, True)])
def test_protocol_ends_a_body_in_tiny_chunks(size: int, is_read: bool) -> None:
    chunk = f"{size}\r\n{size * 'x'}\r\n".encode()
    head = b"POST /check HTTP/1.1\r\nHost: x\r\nConnection: close\r\nTransfer-Encoding: chunked\r\n\r\n"
    try:
        (answer,) = answers(head + 1_500 * chunk + b"0\r\n\r\n")
    except ConnectionError:
        answer = b""
    assert answer.startswith(b"HTTP/1.1 200 ") is is_read


@pytest.mark.parametrize("head", ["POST /ws HTTP/1.1", "GET /ws HTTP/1.1\r\nContent-Length: 5"])
def test_protocol_refuses_a_websocket_by_another_method_or_with_a_body(head: str) -> None:
    (answer,) = answers(UPGRADE.replace(b"GET /ws HTTP/1.1", head.encode()))
    assert re.match(rb"HTTP/1\.1 40[05] ", answer)
