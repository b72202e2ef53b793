"""Tests of the service when engines, the disk, the clock or clients fail."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import io
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import termios
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from benchmarks.packets import encode_text
from bml_schema.feedback import parse_feedback
from realizer.core.settings import Settings
from realizer.protocol.wire import unpack
from realizer.server.serve import Server
from realizer.speech.espeak.voice import EspeakVoice
from tests.ahead import viewed
from tests.feedback_log import seq_numbers
from tests.many_clients import (
    check_feedback,
    connect_and_leave,
    open_files,
    open_websocket,
    send_and_half_close,
    send_simultaneously,
)
from tests.realizer.server.conftest import Clock
from tests.waiting import LIMIT, wait_for

WAIT = '<bml id="{}"><wait id="w" duration="{}"/></bml>'
TALK = '<bml id="{}"><speech id="s"><text>{}</text></speech></bml>'


def serving(test: Callable[[Server], Awaitable[None]], **settings: Any) -> None:
    async def run() -> None:
        values = {"port": 0, "voice": "silent", **settings}
        async with asyncio.timeout(LIMIT), Server(Settings(**values)) as server:
            await test(server)

    asyncio.run(run())


async def until(client: ClientConnection, last: str) -> list[str]:
    """Return the feedback up to the message that contains `last`."""
    feedback = []
    async for message in client:
        if isinstance(message, str) and message.startswith("<"):
            feedback.append(message)
            if last in message:
                return feedback
    raise AssertionError(f"the connection ended before {last}")


async def play(client: ClientConnection, block: str) -> None:
    """Send a short block, and wait for its end."""
    await client.send(WAIT.format(block, 0.05))
    await until(client, f'id="{block}:end"')


# engines ----------------------------------------------------------------------------------------


def unread_bytes(engine: EspeakVoice) -> int:
    """Return how many bytes of a request an engine has not read yet."""
    running = engine._process._running
    assert running is not None
    assert running.process.stdin is not None
    return struct.unpack("i", fcntl.ioctl(running.process.stdin.fileno(), termios.FIONREAD, bytes(4)))[0]


@pytest.mark.espeak
def test_chaos_killed_voice_costs_its_sound_and_one_warning(
    capsys: pytest.CaptureFixture[str],
) -> None:
    async def test(server: Server) -> None:
        async with connect(server.url, max_queue=None) as client:
            await client.send(TALK.format("first", "One."))
            first = await until(client, 'id="first:end"')
            engine = server._sessions._loop.engines._voices["espeak"]
            assert isinstance(engine, EspeakVoice)
            assert engine.pid is not None
            os.kill(engine.pid, signal.SIGSTOP)  # so that it can never answer before it dies
            await client.send(TALK.format("killed", "Two."))
            while not unread_bytes(engine):
                await asyncio.sleep(0)
            os.kill(engine.pid, signal.SIGKILL)
            killed = await until(client, 'id="killed:end"')
            await client.send('{"type":"subscribe","stream":"audio"}')
            await client.send(TALK.format("next", "Three."))
            packets, rest = 0, []
            while not rest or 'id="next:end"' not in rest[-1]:
                message = await client.recv()
                if isinstance(message, bytes):
                    packets += unpack(message).stream == "audio"
                elif message.startswith("<"):
                    rest.append(message)
        assert packets
        warnings = ["warningFeedback" in text for text in (*first, *killed, *rest)]
        assert sum(warnings) == 1
        assert any("warningFeedback" in text and "killed:s" in text for text in killed)
        assert 'status="DONE"' in killed[-1]
        assert seq_numbers(first + killed + rest) == list(range(1, len(warnings) + 1))

    serving(test, voice="espeak")
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("realizer: ")]
    assert len(lines) == 1
    assert lines[0].endswith("going on without sound")


@pytest.mark.gl
@pytest.mark.slow
def test_chaos_killed_renderer_is_started_again() -> None:
    async def picture(client: ClientConnection) -> float:
        while True:
            message = await client.recv()
            if isinstance(message, bytes):
                frame = unpack(message)
                Image.open(io.BytesIO(frame.payload)).load()
                return frame.time
            assert '"error"' not in message

    async def test(server: Server) -> None:
        async with connect(server.url, max_queue=None) as client:
            await client.send('{"type":"subscribe","stream":"video","size":[32,32],"fps":5}')
            times = [await picture(client)]
            (place,) = server._sessions._loop.engines._slots.values()
            assert place.renderer.pid is not None
            os.kill(place.renderer.pid, signal.SIGKILL)
            times += [await picture(client) for _ in range(3)]
            assert times == sorted(set(times))
            await play(client, "b")

    serving(test)


# the disk ---------------------------------------------------------------------------------------


@dataclass
class Disk:
    """A journal on a disk: `fill` uses all of its space, `free` makes room again."""

    path: Path
    fill: Callable[[Server], None]
    free: Callable[[Server], None]


@pytest.fixture(params=["pages", "tmpfs"])
def disk(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Disk]:
    """A journal that reaches the size limit of its database, or, if mounting is allowed, a full disk."""
    if request.param == "pages":

        def limit_pages(server: Server, limit: int) -> None:
            file = server._sessions._factory.journal._file  # type: ignore[union-attr]
            (used,) = file.execute("PRAGMA page_count").fetchone()
            file.execute(f"PRAGMA max_page_count = {limit or used}")

        yield Disk(tmp_path / "journal.db", lambda s: limit_pages(s, 0), lambda s: limit_pages(s, 10**6))
        return
    folder, mount = tmp_path / "disk", shutil.which("mount")
    folder.mkdir()
    options = ["-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if mount is None or subprocess.run([mount, *options], capture_output=True).returncode:
        pytest.skip("wanted the right to mount a disk")
    filler = folder / "filler"

    def fill(server: Server) -> None:
        with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
            while file.write(bytes(512)):
                pass
        assert not shutil.disk_usage(folder).free

    yield Disk(folder / "journal.db", fill, lambda s: filler.unlink())
    subprocess.run(["umount", str(folder)], check=True, capture_output=True)


def test_chaos_full_disk_refuses_documents_and_lets_the_rest_play(disk: Disk) -> None:
    large = f"<!--{'x' * 20_000}-->"

    async def send_documents(server: Server) -> list[str]:
        async with connect(f"{server.url}?session=full", max_queue=None) as client:
            await client.send(WAIT.format("plays", 1.0))
            first = await until(client, 'id="plays:start"')
            disk.fill(server)
            await client.send(WAIT.format("late", 0.1) + large)
            refused = await until(client, 'id="late"')
            assert "warningFeedback" in refused[-1]
            assert "this could not be written to the journal, so it is refused" in refused[-1]
            assert re.search("full|space", refused[-1])
            await client.send(json.dumps({"type": "set", "aus": {"12": 1}, "faps": {"x" * 20_000: 1}}))
            while not (message := str(await client.recv())).startswith("{"):
                refused.append(message)
            assert json.loads(message)["code"] == "journal"
            await client.send('{"type":"ping"}')  # which is not written to the journal
            while not (message := str(await client.recv())).startswith("{"):
                refused.append(message)
            assert json.loads(message)["type"] == "pong"
            if not any('id="plays:end"' in text for text in refused):
                refused += await until(client, 'id="plays:end"')
            disk.free(server)
            await client.send(WAIT.format("again", 0.1))
            return first + refused + await until(client, 'id="again:end"')

    async def run() -> None:
        settings = Settings(port=0, voice="silent", journal=str(disk.path))
        async with asyncio.timeout(LIMIT):
            async with Server(settings) as server:
                feedback = await send_documents(server)
            ends = [text for text in feedback if re.search(r'blockProgress.* id="\w+:end"', text)]
            assert [re.search(r' id="(\w+):end"', text)[1] for text in ends] == ["plays", "again"]  # type: ignore[index]
            # A refused document is not in the journal, and its warning has no `seq`.
            feedback = [text for text in feedback if 'id="late"' not in text]
            assert seq_numbers(feedback) == list(range(1, len(feedback) + 1))
            async with Server(settings) as server, connect(f"{server.url}?session=full&seen=0") as client:
                assert await until(client, 'id="again:end"') == feedback
                await play(client, "afterwards")

    asyncio.run(run())


async def open_many_sessions(server: Server) -> None:
    """Open sessions with new names until the journal refuses one; its last page has room for some."""
    for k in range(1000):
        async with connect(f"{server.url}?session=new-{k}") as client:
            await client.send('{"type":"ping"}')
            await client.recv()


def test_chaos_session_that_cannot_be_stored_is_refused(disk: Disk) -> None:
    async def test(server: Server) -> None:
        async with (
            connect(f"{server.url}?session=there", max_queue=None) as client,
            connect(server.url) as free,
        ):
            disk.fill(server)
            with pytest.raises(ConnectionClosed) as closed:
                await open_many_sessions(server)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1013
            assert "journal" in closed.value.rcvd.reason
            await play(free, "unnamed sessions need no journal")
            disk.free(server)
            await play(client, "b")

    serving(test, journal=str(disk.path))


# the clock --------------------------------------------------------------------------------------


def test_chaos_clock_set_back_and_forth_changes_nothing(clock: Clock) -> None:
    async def test(server: Server) -> None:
        async with connect(server.url, max_queue=None) as client:
            await client.send('<bml id="b"><head id="n" lexeme="NOD"/><wait id="w" duration="0.9"/></bml>')
            feedback = await until(client, 'id="b:start"')
            for step in (-86400.0, 86400.0, -5.0, 0.0):
                clock.step = step
                feedback += await until(client, "syncPointProgress")
            feedback += await until(client, 'id="b:end"')
            assert seq_numbers(feedback) == list(range(1, len(feedback) + 1))
            progress = [f for f in map(parse_feedback, feedback) if hasattr(f, "global_time")]
            times = [f.global_time for f in progress]
            assert times == sorted(times)
            assert times[-1] - times[0] == pytest.approx(0.9, abs=1e-3)

    serving(test)


@pytest.mark.parametrize("step", [-3600.0, -0.3, 3600.0])
def test_chaos_client_under_other_clocks_gets_all_feedback_once(
    clock: Clock, kept: Settings, step: float
) -> None:
    block = '<bml id="b"><head id="n" lexeme="NOD"/><wait id="w" duration="1.5"/></bml>'

    async def run() -> None:
        async with asyncio.timeout(LIMIT):
            async with Server(kept) as server, connect(f"{server.url}?session=s") as client:
                await client.send(block)
                feedback = await until(client, 'id="b:n:end"')  # long after the client's last message
            clock.step = step
            seen = seq_numbers(feedback)[-1]
            async with Server(kept) as server, connect(f"{server.url}?session=s&seen={seen}") as client:
                feedback += await until(client, 'id="b:end"')
                await play(client, "c")
        assert seq_numbers(feedback) == list(range(1, len(feedback) + 1))
        times = [f.global_time for f in map(parse_feedback, feedback) if hasattr(f, "global_time")]
        assert times == sorted(times)

    asyncio.run(run())


@pytest.mark.parametrize("step", [-3600.0, 3600.0])
def test_chaos_clock_that_jumps_does_not_disturb_rows_ahead(
    clock: Clock, kept: Settings, step: float
) -> None:
    async def jump(url: str) -> None:
        async with connect(url) as client:
            await client.send(json.dumps({"type": "subscribe", "stream": "fap", "fps": 10}))
            async for _ in client:
                clock.step = step - clock.step

    async def run() -> None:
        async with asyncio.timeout(LIMIT):
            async with Server(kept) as server:
                jumping = asyncio.create_task(jump(f"{server.url}?session=s"))
                await viewed(f"{server.url}?session=s")
                jumping.cancel()
            clock.step = step
            async with Server(kept) as server:
                await viewed(f"{server.url}?session=s&seen=0")

    asyncio.run(run())


# clients ----------------------------------------------------------------------------------------


async def wait_for_no_connections(server: Server, files: int) -> None:
    """Wait until there are no connections, and no more open files than before."""
    await wait_for(lambda: not server._sessions.health()["connections"] and open_files(os.getpid()) <= files)


@pytest.mark.slow
def test_chaos_hundreds_of_connections_leave_nothing_behind() -> None:
    async def test(server: Server) -> None:
        await asyncio.to_thread(connect_and_leave, server.port, 10, 10)
        files = open_files(os.getpid())
        await wait_for_no_connections(server, files)
        files = open_files(os.getpid())
        await asyncio.to_thread(connect_and_leave, server.port, 600, 10)
        await wait_for_no_connections(server, files)
        assert server._sessions.health() == {"sessions": 10, "connections": 0}
        async with connect(server.url) as client:
            await play(client, "b")

    serving(test, max_sessions=50)


def test_chaos_forty_documents_among_twenty_streams_are_all_played() -> None:
    async def test(server: Server) -> None:
        for feedback in await send_simultaneously(server.port, 20, 40):
            check_feedback(feedback, 2)

    serving(test)


def test_chaos_client_that_closes_its_side_only_is_disconnected() -> None:
    async def test(server: Server) -> None:
        received = await asyncio.to_thread(send_and_half_close, server.port, "show")
        assert b"b:end" not in received
        await wait_for(lambda: not server._sessions.health()["connections"])
        async with connect(f"{server.url}?session=show&seen=0") as again:
            await until(again, 'id="b:end"')  # its document was played

    serving(test)


def test_chaos_clients_without_a_complete_request_delay_nobody(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("realizer.server.http.protocols.OPENING", 3600.0)

    async def test(server: Server) -> None:
        silent = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(100)]
        try:
            for k, client_socket in enumerate(silent):
                client_socket.sendall(
                    (b"", b"GET /ws HT", b"GET /ws HTTP/1.1\r\nHost: x\r\n", b"\x16\x03\x01")[k % 4]
                )
            async with connect(server.url) as client:
                await play(client, "b")
            await server.close()  # does not wait for them
        finally:
            for client_socket in silent:
                client_socket.close()

    serving(test)


def test_chaos_client_that_floods_is_warned_and_delays_nobody() -> None:
    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=other") as other:
            raw = await asyncio.to_thread(open_websocket, server.port, "flooded")
            with raw:
                flood = encode_text(WAIT.format("b", 30)) * 3000
                sending = asyncio.create_task(asyncio.to_thread(raw.sendall, flood))
                for k in range(3):
                    await play(other, f"b{k}")
                async with connect(f"{server.url}?session=flooded&seen=0", max_queue=None) as viewer:
                    await until(viewer, "warningFeedback")
                    await viewer.send('{"type":"ping"}')
                    while '"pong"' not in str(await viewer.recv()):
                        pass
                raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                raw.shutdown(socket.SHUT_RDWR)
                await asyncio.gather(sending, return_exceptions=True)
            await play(other, "last")

    serving(test)
