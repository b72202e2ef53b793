"""The WebSocket transport against clients that misbehave: limits, clear errors, and no effect on others."""

from __future__ import annotations

import asyncio
import io
import json
import signal
import socket as sockets
import struct
import subprocess
import urllib.request
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as dial
from websockets.exceptions import InvalidStatus

from benchmarks.packets import encode_text
from realizer.core.settings import Settings
from realizer.protocol.wire import HEADER, unpack
from realizer.server.serve import Server
from tests.portraits import LITERT, faps_of, portrait
from tests.programs import SERVE, running
from tests.waiting import LIMIT

WAIT = '<bml id="{}"><wait id="w" duration="0.3"/></bml>'


def serving(test: Callable[[Server], Awaitable[None]], **settings: Any) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent", **settings)) as server:
            await test(server)

    asyncio.run(run())


def connect(url: str) -> dial:
    """A client whose close frame does not wait behind frames that it has not read."""
    return dial(url, max_queue=None)


async def ask(socket: ClientConnection, **message: Any) -> dict[str, Any]:
    """The next JSON message after this one was sent."""
    await socket.send(json.dumps(message))
    while True:
        data = await socket.recv()
        if isinstance(data, str) and data.startswith("{"):
            reply: dict[str, Any] = json.loads(data)
            return reply


async def frames(socket: ClientConnection, count: int) -> list[int]:
    """The numbers of the next frames."""
    numbers: list[int] = []
    while len(numbers) < count:
        message = await socket.recv()
        if isinstance(message, bytes):
            numbers.append(unpack(message).frame)
    return numbers


def flows(numbers: list[int]) -> bool:
    """Check that frames come in order, each once. A busy machine leaves some out."""
    return numbers == sorted(set(numbers))


async def plays(socket: ClientConnection, name: str) -> None:
    """A block of this client is played to its end."""
    await socket.send(WAIT.format(name))
    while f'id="{name}:end"' not in str(await socket.recv()):
        pass


def test_websocket_shows_one_sender_and_three_viewers_the_same() -> None:
    async def test(server: Server) -> None:
        async with AsyncExitStack() as stack:
            url = f"{server.url}?session=show"
            manager = await stack.enter_async_context(connect(url))
            viewers = [await stack.enter_async_context(connect(url)) for _ in range(3)]
            streams = ("fap", "au", "arkit")
            for viewer in viewers:
                for stream in streams:
                    subscribed = await ask(viewer, type="subscribe", stream=stream, fps=50)
                    assert subscribed["type"] == "subscribed"
            await manager.send(WAIT.format("b"))
            seen: list[dict[tuple[int, int], bytes]] = []
            heard: list[list[str]] = []
            for viewer in viewers:
                mine: dict[tuple[str, int], bytes] = {}
                said: list[str] = []
                while not said or 'id="b:end"' not in said[-1]:
                    message = await viewer.recv()
                    if isinstance(message, bytes):
                        frame = unpack(message)
                        mine[frame.stream, frame.frame] = frame.payload
                    else:
                        said.append(message)
                seen.append(mine)
                heard.append(said)
            shared = set.intersection(*map(set, seen))
            assert {stream for stream, _ in shared} == {"fap", "au", "arkit"}
            assert len(shared) > 3 * 10
            assert all(one[key] == seen[0][key] for one in seen for key in shared)
            assert heard[0] == heard[1] == heard[2]
            # The client that sends gets only its feedback.
            messages = []
            while not messages or 'id="b:end"' not in messages[-1]:
                messages.append(str(await manager.recv()))
            assert messages == heard[0]
            await manager.send('{"type":"state"}')
            assert json.loads(await manager.recv())["connections"] == 4

    serving(test)


@pytest.mark.parametrize(
    ("message", "code", "where"),
    [
        ({"type": "subscribe", "stream": "smell"}, "unsupported", "subscribe.stream"),
        ({"type": "subscribe", "stream": "video", "size": [9**9, 9**9]}, "invalid", "subscribe.size"),
        ({"type": "subscribe", "stream": "video", "size": [-1, 5]}, "invalid", "subscribe.size.0"),
        ({"type": "subscribe", "stream": "video", "camera": "moon"}, "invalid", "subscribe.camera"),
        (
            {"type": "subscribe", "stream": "video", "background": "transparent"},
            "invalid",
            "subscribe.background",
        ),
        ({"type": "subscribe", "stream": "fap", "fps": 1e6}, "invalid", "subscribe.fps"),
        ({"type": "subscribe", "stream": "fap", "fps": 0}, "invalid", "subscribe.fps"),
        ({"type": "subscribe", "stream": "mesh", "encoding": "json"}, "invalid", "subscribe.encoding"),
        ({"type": "subscribe", "stream": "audio", "rate": 10**9}, "invalid", "subscribe.rate"),
        ({"type": "hello", "version": 2}, "version", "hello.version"),
        (b"\xff\xfe binary where text belongs", "unsupported", None),
        (b"", "unsupported", None),
    ],
)
def test_websocket_answers_unknown_streams_with_one_error(message, code, where) -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(message if isinstance(message, bytes) else json.dumps(message))
            error = json.loads(await socket.recv())
            assert (error["type"], error["code"], error.get("where")) == ("error", code, where)
            assert "wanted" in error["message"] or "should" in error["message"]
            await plays(socket, "b")

    serving(test)


def deaf(server: Server) -> sockets.socket:
    """A WebSocket, by hand, that is never read from; its buffer is as small as can be."""
    raw = sockets.socket()
    raw.setsockopt(sockets.SOL_SOCKET, sockets.SO_RCVBUF, 4096)
    raw.connect(("127.0.0.1", server.port))
    raw.sendall(
        b"GET /ws?session=show HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
    )
    return raw


def test_websocket_drops_frames_only_for_a_viewer_that_never_reads() -> None:
    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=show") as viewer:
            raw = await asyncio.to_thread(deaf, server)
            subscribe = {"type": "subscribe", "stream": "mesh", "fps": 240}
            await asyncio.to_thread(raw.sendall, encode_text(json.dumps(subscribe)))
            await ask(viewer, type="subscribe", stream="fap", fps=50)
            numbers = await frames(viewer, 100)
            assert flows(numbers)
            await plays(viewer, "b")
            raw.close()

    serving(test)


@pytest.mark.slow
def test_websocket_disconnects_a_client_that_asks_and_never_reads() -> None:
    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=show") as other:
            raw = await asyncio.to_thread(deaf, server)
            ping = encode_text(json.dumps({"type": "ping", "id": "x" * 60_000}))

            def flood() -> None:
                while True:
                    raw.sendall(ping)

            with pytest.raises(OSError, match=r"reset|[Pp]ipe"):
                await asyncio.to_thread(flood)
            raw.close()
            await plays(other, "b")
            while (await ask(other, type="state"))["connections"] > 1:
                pass

    serving(test)


def test_websocket_limits_the_connections_of_an_address() -> None:
    async def test(server: Server) -> None:
        async with AsyncExitStack() as stack:
            viewer = await stack.enter_async_context(connect(server.url))
            await ask(viewer, type="subscribe", stream="fap", fps=50)
            for _ in range(19):
                await stack.enter_async_context(connect(server.url))
            for address in (server.url, server.url.replace("/ws", "/check")):
                with pytest.raises(InvalidStatus) as caught:
                    await connect(address)
                assert caught.value.response.status_code == 429
                assert b"20 connections from 127.0.0.1 are open: wanted fewer" in caught.value.response.body
            numbers = await frames(viewer, 50)
            assert flows(numbers)
            await plays(viewer, "b")
        async with connect(server.url) as again:
            await plays(again, "c")

    serving(test, max_connections=20)


@pytest.mark.parametrize(("trusted", "lets_in"), [("127.0.0.0/8", True), ("*", True), ("192.0.2.1", False)])
def test_limits_count_by_client_behind_a_trusted_proxy_only(trusted: str, lets_in: bool) -> None:
    async def test(server: Server) -> None:
        async with dial(server.url, additional_headers={"X-Forwarded-For": "203.0.113.7"}):
            other = dial(server.url, additional_headers={"X-Forwarded-For": "203.0.113.8"})
            if lets_in:
                async with other as client:
                    await plays(client, "b")
                other = dial(server.url, additional_headers={"X-Forwarded-For": "203.0.113.7"})
            with pytest.raises(InvalidStatus) as caught:
                await other
            assert caught.value.response.status_code == 429
            where = "203.0.113.7" if lets_in else "127.0.0.1"
            assert f"1 connections from {where} are open".encode() in caught.value.response.body
            assert int(caught.value.response.headers["Retry-After"]) > 0

    serving(test, max_connections=1, forwarded_allow_ips=(trusted,))


@pytest.mark.slow
def test_websocket_survives_one_who_reconnects_again_and_again() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as viewer:
            await ask(viewer, type="subscribe", stream="fap", fps=25)
            for k in range(200):
                # A name for each: the sessions stay, and make room for those that follow.
                async with connect(f"{server.url}?session=many-{k}"):
                    pass
            numbers = await frames(viewer, 25)
            assert flows(numbers)
            await plays(viewer, "b")
        async with connect(f"{server.url}?session=new") as late:
            await plays(late, "c")

    serving(test, max_sessions=100)


HELD = (
    '<bml id="h"><faceFacs id="a" au="12" amount="1" start="0" attackPeak="0.1" relax="60" end="61"/>'
    '<faceFacs id="b" au="1" amount="1" start="0" attackPeak="0.1" relax="60" end="61"/></bml>'
)


@pytest.mark.gl
@pytest.mark.slow
def test_websocket_video_shows_what_is_drawn_without_a_clock() -> None:
    import realizer
    from tests.pictures import drawn_here

    size, shown = (96, 80), {}

    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(HELD)
            for form in ("png", "webp"):
                video = {"stream": "video", "format": form, "quality": 100, "size": size, "fps": 5}
                assert (await ask(socket, type="subscribe", **video))["media_type"] == f"image/{form}"
                while form not in shown:
                    message = await socket.recv()
                    frame = unpack(message) if isinstance(message, bytes) else None
                    if frame is not None and frame.time > 1.0:
                        picture = Image.open(io.BytesIO(frame.payload))
                        if picture.format == form.upper():
                            shown[form] = np.asarray(picture.convert("RGB")).astype(int)

    serving(test, idle=False)
    (still,) = drawn_here("default", size, realizer.realize(HELD, fps=1, idle=False).poses[1:2])
    assert np.abs(shown["png"] - still).max() <= 2
    assert np.abs(shown["webp"] - still).mean() < 2


def test_websocket_closes_a_connection_whose_message_is_too_long() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as other, connect(server.url) as socket:
            await socket.send(f"<bml id='b'><!--{'x' * 3000}--></bml>")
            assert "wanted at most 2000 bytes" in await socket.recv()
            await plays(socket, "c")
            await socket.send(b"x" * 20_000)
            await socket.wait_closed()
            assert socket.close_code == 1009
            await plays(other, "d")

    serving(test, max_message=10_000, max_document=2_000)


@pytest.mark.slow
def test_websocket_answers_a_crowd_that_asks_for_everything() -> None:
    async def test(server: Server) -> None:
        async def one(number: int) -> None:
            url = f"{server.url}?session=crowd-{number % 4}"
            async with connect(url) as socket:
                for stream in ("fap", "au", "arkit", "mesh", "audio", "schedule"):
                    await socket.send(json.dumps({"type": "subscribe", "stream": stream}))
                await plays(socket, f"b{number}")

        async with asyncio.TaskGroup() as group:
            for number in range(12):
                group.create_task(one(number))

    serving(test)


def test_websocket_leaves_no_traceback_when_a_client_resets() -> None:
    with running(SERVE, stderr=subprocess.PIPE) as service:
        assert service.stdout is not None
        port = urlsplit(service.stdout.readline().split()[2]).port
        for _ in range(20):
            with sockets.create_connection(("127.0.0.1", port)) as client:
                client.setsockopt(sockets.SOL_SOCKET, sockets.SO_LINGER, struct.pack("ii", 1, 0))
                client.sendall(
                    b"GET /ws HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
                )
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=LIMIT) as answer:
            assert answer.status == 200
        service.send_signal(signal.SIGTERM)
        _, logged = service.communicate(timeout=LIMIT)
    assert not logged


@LITERT
@pytest.mark.gl("onboard")
def test_pictures_of_a_camera_drive_the_face() -> None:
    content = io.BytesIO()
    portrait("ada", faps_of("ada", AU12=0.9)).save(content, "jpeg")

    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(json.dumps({"type": "track", "fps": 20}))
            await socket.send(HEADER.pack(3, 1, 0, 5, 0.0) + content.getvalue())
            tracked = json.loads(await socket.recv())
            assert (tracked["type"], tracked["frame"], tracked["face"]) == ("tracked", 5, True)
            subscribed = await ask(socket, type="subscribe", stream="au", encoding="json", fps=25)
            smile = subscribed["names"].index("12L")
            while json.loads(await socket.recv())["values"][smile] < 0.95 * tracked["aus"]["12L"]:
                pass  # it begins to smile
            assert tracked["aus"]["12L"] > 0.4

    serving(test, idle=False)
