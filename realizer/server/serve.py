"""The only sockets and the only event loop: WebSocket messages in and out of sessions, HTTP beside them."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import http
import itertools
import logging
import signal
from collections import deque
from collections.abc import Mapping
from types import TracebackType
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as listen
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from realizer.behaviours.kind import Position
from realizer.server.effects import Close, Draw, Effect, Send, Speak
from realizer.server.hub import Hub, HubError
from realizer.server.session import Session
from realizer.server.site import Answer, Site
from realizer.server.studio import Studio
from realizer.settings import Settings

__all__ = ["Server", "run", "serve"]

log = logging.getLogger(__name__)

# How often sessions that nobody visits are looked for.
SWEEP = 5.0  # s
# How often the drain looks whether everything has ended.
DRAIN_STEP = 0.05  # s


async def serve(settings: Settings | None = None) -> None:
    """Serve until SIGINT or SIGTERM; then take no more work, give what plays `settings.drain` s, and end.

    Prints one line per open door when it is ready.
    """
    server = await Server(settings).start()
    loop = asyncio.get_running_loop()
    asked = asyncio.Event()
    signals = (signal.SIGINT, signal.SIGTERM)
    for number in signals:
        loop.add_signal_handler(number, asked.set)
    try:
        print(f"listening on {server.url}", f"page at {server.page}", sep="\n", flush=True)
        await asked.wait()
        for number in signals:  # a second one ends at once
            loop.remove_signal_handler(number)
        await server.drain()
    finally:
        await server.close()


def run(settings: Settings | None = None) -> None:
    """`serve` in an event loop of its own: uvloop's where it is installed."""
    try:
        import uvloop
    except ImportError:
        asyncio.run(serve(settings))
    else:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(serve(settings))


class Server:
    """The service inside an event loop: `start`, then `close`; or `async with Server(settings) as server`."""

    def __init__(self, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self.port = self.settings.port
        self._hub = Hub(self._make, self.settings.max_sessions)
        self._studio = Studio()
        self._site = Site(self._health)
        self._clients: dict[int, _Client] = {}
        self._timers: dict[Session, asyncio.TimerHandle] = {}
        self._numbers = itertools.count(1)
        self._socket: SocketServer | None = None
        self._sweeper: asyncio.TimerHandle | None = None
        self._scene: Mapping[str, Position] | None = None
        self._capabilities: dict[str, Any] = {}
        self._closed = asyncio.Event()
        self._ending = False

    @property
    def url(self) -> str:
        """Where BML goes."""
        return f"ws://{self._host}:{self.port}/ws"

    @property
    def page(self) -> str:
        """The page's address."""
        return f"http://{self._host}:{self.port}/"

    async def start(self) -> Server:
        """Open the door; `port` is then the one that is open.

        Raises:
            OSError: the address cannot be had.
            ValueError: the scene file is not a scene.
            FaceError: no such face.
        """
        settings = self.settings
        self._loop = asyncio.get_running_loop()
        if settings.scene is not None:
            from realizer.pipeline import parse_scene

            self._scene = parse_scene(settings.scene.read_text("utf-8"))
        # A face that is not there is said before the door opens.
        from realizer.face import load_face

        await self._loop.run_in_executor(None, load_face, settings.face)
        self._capabilities = await self._loop.run_in_executor(None, _capabilities)
        self._socket = await listen(
            self._handle,
            settings.host,
            settings.port,
            process_request=self._http,
            compression=None,  # frames are dense and late is worse than large
            max_size=settings.max_message,
            ping_interval=20,
            ping_timeout=60,
            close_timeout=2,
            server_header=None,
        )
        self.port = next(iter(self._socket.sockets)).getsockname()[1]
        self._sweeper = self._loop.call_later(SWEEP, self._sweep)
        return self

    async def drain(self) -> None:
        """Take no more connections and documents; wait for what plays, at most `settings.drain` seconds."""
        self._ending = True
        for session in self._hub.sessions.values():
            session.ending = True
        if self._socket is not None:
            self._socket.close(close_connections=False)
        last = self._loop.time() + self.settings.drain
        while any(s.busy for s in self._hub.sessions.values()) and self._loop.time() < last:
            await asyncio.sleep(DRAIN_STEP)

    async def close(self) -> None:
        """End every connection and every engine."""
        if self._closed.is_set():
            return
        if self._socket is not None:
            self._socket.close(close_connections=False)
            for socket in list(self._socket.connections):
                # After a drain the door is closed already; its connections are closed one by one.
                self._loop.create_task(socket.close(1001, "the service ends"))
            await self._socket.wait_closed()
        for timer in (*self._timers.values(), self._sweeper):
            if timer is not None:
                timer.cancel()
        self._timers.clear()
        for session in self._hub.sessions.values():
            session.close()
        await self._loop.run_in_executor(None, self._studio.close)
        self._closed.set()

    async def wait_closed(self) -> None:
        """Wait until somebody calls `close`."""
        await self._closed.wait()

    async def __aenter__(self) -> Server:
        return await self.start()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    # sockets ------------------------------------------------------------------------------------

    async def _http(self, connection: ServerConnection, request: Request) -> Response | None:
        """Everything but a WebSocket at /ws is answered here."""
        path = urlsplit(request.path).path
        upgrade = request.headers.get("Upgrade", "").lower() == "websocket"
        if path == "/ws" and upgrade:
            try:
                self._hub.check(_query(request)[0])
            except HubError as error:
                return _response(Answer(error.status, "text/plain; charset=utf-8", f"{error}\n".encode()))
            return None
        if path == "/ws" or upgrade:
            words = f"wanted a WebSocket at /ws, got {'a WebSocket' if upgrade else 'plain HTTP'} at {path}\n"
            return _response(Answer(426 if not upgrade else 404, "text/plain; charset=utf-8", words.encode()))
        return _response(await self._loop.run_in_executor(None, self._site.answer, request.path))

    async def _handle(self, socket: ServerConnection) -> None:
        """One WebSocket, from its opening to its end."""
        assert socket.request is not None
        number = next(self._numbers)
        client = self._clients[number] = _Client(socket)
        writer = asyncio.create_task(client.write())
        try:
            session = self._hub.open(
                number, *_query(socket.request)[:1], self._loop.time(), _query(socket.request)[1]
            )
            self._pump(session)
            async for message in socket:
                there = self._hub.session_of(number)
                if there is None:
                    break
                there.receive(number, message, self._loop.time())
                self._pump(there)
        except ConnectionClosed:
            pass
        except HubError as error:
            await socket.close(1013, str(error)[:120])
        finally:
            left = self._hub.session_of(number)
            self._hub.leave(number, self._loop.time())
            del self._clients[number]
            writer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await writer
            if left is not None:
                self._arm(left)

    # sessions -----------------------------------------------------------------------------------

    def _make(self, id: str, now: float, named: bool) -> Session:
        session = Session(
            id, self.settings, now, named=named, scene=self._scene, capabilities=self._capabilities
        )
        session.ending = self._ending
        return session

    def _pump(self, session: Session) -> None:
        """Do what a session wants done, then wake it when it next has something."""
        for effect in self._hub.effects(session, self._loop.time()):
            self._do(session, effect)
        self._arm(session)

    def _arm(self, session: Session) -> None:
        """One timer a session."""
        if (timer := self._timers.pop(session, None)) is not None:
            timer.cancel()
        deadline = session.next_deadline()
        if deadline is not None:
            when = max(deadline, self._loop.time())
            self._timers[session] = self._loop.call_at(when, self._tick, session)

    def _tick(self, session: Session) -> None:
        for number in session.connections:
            session.backlog(number, self._clients[number].waiting)
        try:
            session.tick(self._loop.time())
        except Exception:
            log.exception("session %s ends: it failed", session.id)
            for number in session.connections:
                self._do(session, Close(number, 1011, "internal error"))
            session.close()
            self._hub.sessions.pop(session.id, None)
        self._pump(session)

    def _do(self, session: Session, effect: Effect) -> None:
        match effect:
            case Send(connection, data):
                if (client := self._clients.get(connection)) is not None:
                    client.send(data)
            case Speak(id):
                future = self._loop.run_in_executor(self._studio.speakers, self._studio.speak, effect)
                future.add_done_callback(functools.partial(self._answered, session, session.spoken, id))
            case Draw(id):
                drawing = self._loop.run_in_executor(self._studio.drawers, self._studio.draw, effect)
                drawing.add_done_callback(functools.partial(self._answered, session, session.drawn, id))
            case Close(connection, code, reason):
                if (client := self._clients.get(connection)) is not None:
                    client.end(code, reason)

    def _answered(self, session: Session, tell: Any, id: int, future: asyncio.Future[Any]) -> None:
        if not future.cancelled() and not self._closed.is_set():
            tell(id, future.result(), self._loop.time())
            self._pump(session)

    def _sweep(self) -> None:
        self._hub.sweep(self._loop.time())
        self._sweeper = self._loop.call_later(SWEEP, self._sweep)

    def _health(self) -> dict[str, object]:
        return {"sessions": len(self._hub.sessions), "connections": len(self._clients)}

    @property
    def _host(self) -> str:
        host = self.settings.host
        if host in ("", "0.0.0.0", "::"):
            return "127.0.0.1"
        return f"[{host}]" if ":" in host else host


class _Client:
    """The way out to one WebSocket: messages queue here while the socket is slow."""

    def __init__(self, socket: ServerConnection) -> None:
        self._socket = socket
        self._queue: deque[str | bytes] = deque()
        self._queued = 0
        self._wake = asyncio.Event()
        self._end: tuple[int, str] | None = None

    @property
    def waiting(self) -> int:
        """Bytes that were not yet taken by the network."""
        transport = self._socket.transport
        return self._queued + (0 if transport is None else transport.get_write_buffer_size())

    def send(self, data: str | bytes) -> None:
        self._queue.append(data)
        self._queued += len(data)
        self._wake.set()

    def end(self, code: int, reason: str) -> None:
        self._end = (code, reason)
        self._wake.set()

    async def write(self) -> None:
        """Write what queues, in order, until the socket closes."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._queue and self._end is None:
                    data = self._queue.popleft()
                    self._queued -= len(data)
                    await self._socket.send(data)
                if self._end is not None:
                    await self._socket.close(*self._end)
                    return


def _query(request: Request) -> tuple[str | None, int | None]:
    """`?session=ID&seen=N`; a `seen` that is no number is none."""
    query = parse_qs(urlsplit(request.path).query)
    session = query.get("session", [None])[-1]
    seen = query.get("seen", [""])[-1]
    return session, int(seen) if seen.isascii() and seen.isdigit() and len(seen) < 16 else None


def _response(answer: Answer) -> Response:
    headers = Headers(
        {
            "Content-Type": answer.media_type,
            "Content-Length": str(len(answer.body)),
            "X-Content-Type-Options": "nosniff",
            "Connection": "close",
            **dict(answer.headers),
        }
    )
    return Response(answer.status, http.HTTPStatus(answer.status).phrase, headers, answer.body)


def _capabilities() -> dict[str, Any]:
    """What `welcome` tells beside streams: elements, faces and voices."""
    from realizer.behaviours import KINDS
    from realizer.face import list_faces
    from realizer.speech import voices

    return {
        "behaviours": sorted(tag.partition("}")[2] for tag in KINDS),
        "faces": [face.name for face in list_faces()],
        "voices": [voice.name for voice in voices() if voice.available],
    }
