"""The real service on loopback: a WebSocket client, HTTP, several clients, and its end."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from bml_schema.feedback import BlockProgress, SyncPointProgress, parse_feedback
from realizer.core.settings import Settings, SettingsError
from realizer.protocol.wire import unpack
from realizer.server.serve import Server, serve, wait_for_signal, work
from realizer.server.session.session import Session
from tests.programs import SERVE, running
from tests.waiting import LIMIT

DOCUMENT = """<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b">
  <speech id="s"><text>One <sync id="m"/>two</text></speech>
  <head id="n" lexeme="NOD" stroke="s:m"/>
  <faceLexeme id="f" lexeme="SMILE" end="s:end"/>
</bml>"""
POINTS = {
    "s": ["start", "m", "end"],
    "n": ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"],
    "f": ["start", "attackPeak", "relax", "end"],
}


def serving(test: Callable[[Server], Awaitable[None]], loop=None, **settings) -> None:
    """Run a test against a service of its own, in an event loop of a kind."""

    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent", **settings)) as server:
            await test(server)

    with asyncio.Runner(loop_factory=loop) as runner:
        runner.run(run())


async def until(socket, last: str) -> list[str | bytes]:
    """Messages up to the block progress `last`."""
    messages = []
    async for message in socket:
        messages.append(message)
        if isinstance(message, str) and f'id="{last}"' in message:
            return messages
    raise AssertionError(f"the connection ended before {last}")


def test_serve_plays_a_document() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(
                json.dumps({"type": "subscribe", "stream": "fap", "encoding": "json", "fps": 25})
            )
            await socket.send(json.dumps({"type": "subscribe", "stream": "au", "fps": 50}))
            await socket.send(DOCUMENT)
            messages = await until(socket, "b:end")
        feedback = [parse_feedback(m) for m in messages if isinstance(m, str) and m.startswith("<")]
        progress = [f for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]
        assert [progress[0].id, progress[-1].id] == ["b:start", "b:end"]
        for behaviour, points in POINTS.items():
            own = [f.id.split(":", 2)[2] for f in progress if f.id.startswith(f"b:{behaviour}:")]
            assert own == points
        assert [f.global_time for f in progress] == sorted(f.global_time for f in progress)
        of = {f.id: f.time for f in progress if isinstance(f, SyncPointProgress)}
        assert of["b:n:stroke"] == pytest.approx(of["b:s:m"], abs=1e-3)

        frames = [
            m for m in map(json.loads, (m for m in messages if str(m).startswith("{"))) if m["type"] == "fap"
        ]
        numbers = [f["frame"] for f in frames]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert all(f["time"] == pytest.approx(f["frame"] / 25) and len(f["values"]) == 68 for f in frames)
        binary = [unpack(m) for m in messages if isinstance(m, bytes)]
        assert {f.stream for f in binary} == {"au"}
        assert all(f.time == pytest.approx(f.frame / 50) for f in binary)
        assert [f.frame for f in binary] == sorted({f.frame for f in binary})

    serving(test)


def test_serve_sends_a_mesh_that_moves_and_fits_the_face() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(json.dumps({"type": "subscribe", "stream": "mesh", "fps": 10}))
            subscribed = json.loads(await socket.recv())
            frame = unpack(await socket.recv())
        assert frame.values.shape == (subscribed["vertices"], 3)
        face = await asyncio.to_thread(fetch, server.page + f"faces/{subscribed['face']}")
        assert face[0] == 200

    serving(test)


def test_serve_keeps_a_connection_after_a_broken_document() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send("<bml id='x'><oops")
            assert "warningFeedback" in await socket.recv()
            await socket.send("{nonsense")
            assert json.loads(await socket.recv())["code"] == "bad-json"
            await socket.send('<bml id="b"><wait id="w" duration="0.05"/></bml>')
            await until(socket, "b:end")

    serving(test)


def test_serve_shares_named_sessions_only() -> None:
    async def test(server: Server) -> None:
        show = f"{server.url}?session=show"
        async with connect(show) as manager, connect(show) as viewer, connect(server.url) as stranger:
            await manager.send('<bml id="b"><wait id="w" duration="0.05"/></bml>')
            sent, seen = await until(manager, "b:end"), await until(viewer, "b:end")
            assert sent == seen
            await stranger.send('{"type":"state"}')
            assert json.loads(await stranger.recv())["session"] != "show"
        async with connect(f"{show}&seen=2") as again:
            assert await until(again, "b:end") == sent[2:]

    serving(test)


def test_serve_plays_on_when_another_client_leaves() -> None:
    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=show") as stays:
            leaves = await connect(f"{server.url}?session=show")
            await leaves.send(json.dumps({"type": "subscribe", "stream": "fap", "fps": 240}))
            await leaves.send(DOCUMENT)
            await until(stays, "b:start")
            leaves.transport.abort()
            await until(stays, "b:end")

    serving(test)


def test_serve_refuses_a_bad_session_name_before_the_handshake() -> None:
    async def test(server: Server) -> None:
        with pytest.raises(InvalidStatus) as caught:
            await connect(f"{server.url}?session=a%20b")
        assert caught.value.response.status_code == 400
        assert b"wanted 1..64" in caught.value.response.body
        with pytest.raises(InvalidStatus) as caught:
            await connect(server.url.replace("/ws", "/other"))
        assert caught.value.response.status_code == 404

    serving(test)


def fetch(url: str) -> tuple[int, str, bytes]:
    try:
        with urllib.request.urlopen(url, timeout=LIMIT) as answer:
            return answer.status, answer.headers["Content-Type"], answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.headers["Content-Type"], error.read()


def test_serve_answers_http_on_the_same_port() -> None:
    async def test(server: Server) -> None:
        status, media_type, body = await asyncio.to_thread(fetch, server.page + "healthz")
        assert (status, media_type) == (200, "application/json; charset=utf-8")
        assert json.loads(body)["status"] == "ok"
        assert (await asyncio.to_thread(fetch, server.page + "healthz?worker=0"))[0] == 200
        missing = (404, "text/plain; charset=utf-8", b"worker: wanted a number of 0..0, got '1'\n")
        assert await asyncio.to_thread(fetch, server.page + "metrics?worker=1") == missing
        assert (await asyncio.to_thread(fetch, server.page + "nothing"))[0] == 404
        assert (await asyncio.to_thread(fetch, server.page + "ws"))[0] == 426

    serving(test)


def test_serve_checks_the_texts_of_an_editor_one_after_the_other() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url.removesuffix("/ws") + "/check") as editor:
            for lexeme in ("NOD", "NIX"):
                await editor.send(f'<bml id="a"><head id="n" lexeme="{lexeme}"/></bml>')
            answers = [json.loads(await editor.recv()) for _ in range(2)]
            assert [len(answer["faults"]) for answer in answers] == [0, 1]
            await editor.send(b"<bml/>")
            with pytest.raises(ConnectionClosed, match="wanted text"):
                await editor.recv()

    serving(test)


def test_serve_answers_the_face_tab_in_order_and_saves_only_where_it_may() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url.removesuffix("/ws") + "/studio", max_size=None) as page:
            for question in ({"type": "save", "name": "x", "setup": {}}, {"type": "open", "face": "ada"}):
                await page.send(json.dumps(question))
            assert "--edit DIR" in json.loads(await page.recv())["error"]
            head = await page.recv()
            assert isinstance(head, bytes)
            assert not json.loads(head[4 : 4 + int.from_bytes(head[:4], "little")])["editable"]

    serving(test)


def test_server_drain_waits_for_what_plays_and_refuses_documents() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send('<bml id="b"><wait id="w" duration="0.4"/></bml>')
            assert "predictionFeedback" in await socket.recv()
            draining = asyncio.create_task(server.drain())
            await until(socket, "b:start")
            await socket.send('<bml id="late"><wait id="w"/></bml>')
            messages = await until(socket, "b:end")
            assert any('id="late"' in m and "ending" in m for m in messages)
            await draining
            with pytest.raises(OSError, match="Connect"):
                await connect(server.url)
            await server.close()
            await socket.wait_closed()
            assert socket.close_code == 1001

    serving(test)


def test_server_start_raises_if_the_address_is_in_use() -> None:
    async def test(server: Server) -> None:
        with pytest.raises(OSError, match="in use"):
            await Server(Settings(port=server.port)).start()

    serving(test)


@pytest.mark.parametrize("workers", [1, 2])
def test_serve_names_a_host_that_does_not_exist(workers: int) -> None:
    settings = Settings(host="nowhere.invalid", port=0, workers=workers, insecure=True)
    with pytest.raises(SettingsError, match=r"setting host: wanted .*, got 'nowhere\.invalid'"):
        asyncio.run(serve(settings))


def test_serve_prints_a_line_for_each_transport_that_is_ready() -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # bound, but not listening
        there = f"127.0.0.1:{nobody.getsockname()[1]}"
        ours = ("--asap-ports", "0", "7501", "--xface-port", "0")
        with running(
            [*SERVE, *ours, "--stomp", there, "--xface-player", there], stderr=subprocess.PIPE
        ) as serving:
            assert serving.stdout is not None
            assert serving.stderr is not None
            lines = [serving.stdout.readline() for _ in range(4)]
            warnings = sorted(serving.stderr.readline() for _ in range(2))
            serving.send_signal(signal.SIGTERM)
            assert (serving.wait(LIMIT), serving.stdout.read()) == (0, "")
    starts = ["listening on ws://127.0.0.1:", "page at http://127.0.0.1:", "asap: BML at 127.0.0.1:"]
    starts.append("xface: tasks at 127.0.0.1:")
    assert all(line.startswith(start) for line, start in zip(lines, starts, strict=True))
    assert warnings[0] == f"realizer: stomp: no broker at {there} (nobody answers); looking for it\n"
    assert warnings[1].startswith(f"realizer: xface player: no player at {there} (")


def test_serve_names_what_a_transport_needs_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "stomp.py").write_text("raise ImportError")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    with running([*SERVE, "--stomp", "127.0.0.1:61613"], stderr=subprocess.PIPE, env=environment) as serving:
        out, error = serving.communicate(timeout=LIMIT)
    assert (serving.returncode, out) == (3, "")
    assert error == "realizer: --stomp needs stomp.py: pip install 'bml-realizer[stomp]'\n"


def test_serve_ends_no_session_when_a_message_fails(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    real = Session.receive

    def broken(session: Session, connection: int, message: str | bytes, now: float) -> None:
        if "boom" in str(message):
            raise RuntimeError("boom")
        real(session, connection, message, now)

    monkeypatch.setattr(Session, "receive", broken)

    async def test(server: Server) -> None:
        async with connect(server.url) as other, connect(server.url) as failing:
            await failing.send("<boom/>")
            assert json.loads(await failing.recv())["code"] == "internal"
            await failing.send('<bml id="a"><wait id="w" duration="0.05"/></bml>')
            await until(failing, "a:end")
            await other.send('<bml id="b"><wait id="w" duration="0.05"/></bml>')
            await until(other, "b:end")

    serving(test)
    assert "internal error" in caplog.text


def test_serve_plays_the_blocks_of_a_client_that_keeps_sending() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as client:
            await client.send('<bml id="b"><wait id="w" duration="0.3"/></bml>')

            async def flood() -> None:
                while True:
                    await client.send('{"type":"unsubscribe","stream":"fap"}')
                    await asyncio.sleep(0)

            flooding = asyncio.create_task(flood())
            await until(client, "b:end")
            flooding.cancel()

    serving(test)


@pytest.mark.parametrize("loop", ["asyncio", "uvloop"])
def test_serve_plays_messages_in_quick_succession(loop) -> None:
    factory = None
    if loop == "uvloop":
        factory = pytest.importorskip("uvloop", reason="needs the fast extra").new_event_loop

    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            for n in range(20):
                await socket.send(f'<bml id="b{n}"/>')
                await socket.send('{"type":"ping"}')
            messages = await until(socket, "b19:end")
            assert sum(":end" in m for m in messages) == 20

    serving(test, factory)


class WindowsLoop(asyncio.SelectorEventLoop):
    """An event loop without signal handlers, as those of Windows."""

    def add_signal_handler(self, sig: int, callback: object, *args: object) -> None:
        raise NotImplementedError

    def remove_signal_handler(self, sig: int) -> bool:
        raise NotImplementedError


@pytest.mark.parametrize("loop", [asyncio.SelectorEventLoop, WindowsLoop])
def test_serve_ends_at_a_signal_in_every_event_loop(loop) -> None:
    before = signal.getsignal(signal.SIGTERM)

    async def end() -> object:
        ending = wait_for_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
        async with asyncio.timeout(LIMIT):
            await ending
        return signal.getsignal(signal.SIGTERM)

    try:
        with asyncio.Runner(loop_factory=loop) as runner:
            assert runner.run(end()) == signal.SIG_DFL  # a second one ends the process
    finally:
        signal.signal(signal.SIGTERM, before)


def test_worker_can_be_terminated_before_it_is_ready() -> None:
    handlers: list[object] = []

    class Control(socket.socket):
        """Notes how SIGTERM is handled when something is sent."""

        def send(self, data: bytes, flags: int = 0) -> int:  # type: ignore[override]
            handlers.append(signal.getsignal(signal.SIGTERM))
            return super().send(data, flags)

    async def run() -> None:
        ours, theirs = socket.socketpair()
        with ours, Control(fileno=theirs.detach()) as control:
            for end in (ours, control):
                end.setblocking(False)
            async with asyncio.timeout(LIMIT):
                working = asyncio.create_task(work(Settings(port=0, voice="silent"), 0, control))
                await asyncio.get_running_loop().sock_recv(ours, 1)
                signal.raise_signal(signal.SIGTERM)
                await working

    asyncio.run(run())
    assert len(handlers) == 1
    assert handlers[0] != signal.SIG_DFL


FIRST_ARKIT = """
import asyncio, json, sys
from concurrent.futures import ThreadPoolExecutor
from websockets.asyncio.client import connect
from realizer.animation import arkit
from realizer.core.settings import Settings
from realizer.server.serve import Server

async def run():
    loop = asyncio.get_running_loop()
    loop.set_default_executor(ThreadPoolExecutor(1))
    async with Server(Settings(port=0, voice="silent")) as server, connect(server.url) as socket:
        await loop.run_in_executor(None, len, "")  # after the warm-up in the background
        for stream in ("fap", "arkit"):
            modules, misses = set(sys.modules), arkit._system.cache_info().misses
            await socket.send(json.dumps({"type": "subscribe", "stream": stream, "encoding": "json"}))
            while json.loads(await socket.recv())["type"] != stream:
                pass
        print(json.dumps([sorted(set(sys.modules) - modules), arkit._system.cache_info().misses - misses]))

asyncio.run(run())
"""


def test_server_loads_nothing_for_the_first_arkit_subscription() -> None:
    done = subprocess.run(
        [sys.executable, "-c", FIRST_ARKIT], capture_output=True, text=True, check=True, timeout=LIMIT
    )
    assert json.loads(done.stdout) == [[], 0]


def test_serve_ends_its_workers_if_printing_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[Settings] = []

    class Workers:
        port = 0

        def __init__(self, settings: Settings, target: object) -> None:
            self._settings = settings

        async def start(self) -> Workers:
            return self

        async def close(self) -> None:
            closed.append(self._settings)

    def gone(*_: object, **__: object) -> None:
        raise BrokenPipeError

    monkeypatch.setattr("realizer.server.runtime.workers.Workers", Workers)
    monkeypatch.setattr("builtins.print", gone)
    settings = Settings(workers=2, port=0)
    with pytest.raises(BrokenPipeError):
        asyncio.run(serve(settings))
    assert closed == [settings]
