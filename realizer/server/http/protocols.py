"""The protocols of uvicorn for one connection, with limits of what is read, and of how long it may take."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from email.utils import formatdate
from functools import lru_cache
from typing import Any, cast

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CTRL_OPCODES, Frame, Opcode
from websockets.protocol import Event, State
from websockets.server import ServerProtocol

from realizer.server.transports.rate_limiter import UNIT, RateLimiter

GOODBYE = 2.0  # s; a client that has not answered a close frame by then is gone
OPENING = 10.0  # s; time for the head of a request, and for some progress of an answer
# Bytes that are parsed before others have their turn: 3 ms of empty frames, or 2 ms of chunks of a byte.
SLICE, HTTP_SLICE = 4 * 1024, 1024
# A connection may send so many parts of requests, and one more for so many bytes: a body in chunks of a byte
# takes a hundred times as long to parse as other bodies, also after its client has gone.
FEW_PARTS, LEAST_PART = 250, 8
# In the extensions of an ASGI scope: an `Output`, by which the application sends without a task.
EXTENSION = "realizer.output"


class Connection(asyncio.Protocol):
    """A connection, whose bytes a protocol of uvicorn parses: that of HTTP, later perhaps that of WebSockets.

    They are parsed at a limited rate, in slices between which others have their turn. Every frame counts,
    also control frames and fragments, every part of a request, and every `UNIT` of bytes.

    Args:
        rate: frames a second; after a pause twice as many may come at once.
        counts: of the metrics.
        opened: has this object as long as the connection lasts.
        named: for the protocols, as uvicorn passes it.
    """

    def __init__(self, rate: float, counts: Counter[str], opened: set[Connection], **named: Any) -> None:
        self.counts = counts
        self._opened = opened
        self.closed = asyncio.Event()
        self._protocol: HttpProtocol | SocketProtocol = HttpProtocol(self, **named)
        self._limiter = RateLimiter(rate)
        self._loop = asyncio.get_running_loop()
        self._unread = b""
        self._is_paused = False  # by the protocol, until the application has taken what was parsed
        self._next: asyncio.Handle | None = None
        self._before = (0, 0)  # what `_check_progress` saw

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)  # uvloop has classes of its own
        self._opened.add(self)
        self._protocol.connection_made(cast(asyncio.Transport, _Transport(self.transport, self)))
        self._check = self._loop.call_later(OPENING, self._check_progress)

    def switch(self, protocol: SocketProtocol) -> None:
        """Continue with a WebSocket."""
        self._protocol = protocol

    def connection_lost(self, exc: Exception | None) -> None:
        self._drop_unread()
        self._check.cancel()
        self._protocol.connection_lost(exc)
        self._opened.discard(self)
        self.closed.set()

    def eof_received(self) -> bool | None:
        self._drop_unread()
        return self._protocol.eof_received()

    def pause_writing(self) -> None:
        self._protocol.pause_writing()

    def resume_writing(self) -> None:
        self._protocol.resume_writing()

    def data_received(self, data: bytes) -> None:
        self._unread += data
        if self._next is None:
            self._go_on()
        else:
            self.transport.pause_reading()

    def pause_reading(self) -> None:
        """Parse no more until `resume_reading`."""
        self._is_paused = True
        self.transport.pause_reading()

    def resume_reading(self) -> None:
        """Parse more, later: the caller may be parsing."""
        if self._is_paused:
            self._is_paused = False
            self._go_on_later()

    def _go_on(self) -> None:
        """Parse a slice of what has come; read more when all of it is parsed and the rate allows it."""
        self._next = None
        if self._unread and not self._is_paused:
            protocol, before = self._protocol, self._protocol.parts
            part, self._unread = self._unread[: protocol.slice], self._unread[protocol.slice :]
            protocol.data_received(part)
            count = protocol.parts - before + len(part) / UNIT
            pause = self._limiter.wait(self._loop.time(), count)
            if self._limiter.notice is not None:
                self.counts["rate_exceeded"] += 1
                self._protocol.warn(self._limiter.notice)
            if pause or self._unread:
                self._go_on_later(pause)
        if self.transport.is_closing():
            self._drop_unread()
        elif self._next or self._is_paused:
            self.transport.pause_reading()
        else:
            self.transport.resume_reading()

    def _go_on_later(self, pause: float = 0.0) -> None:
        if self._next is None:
            self._next = self._loop.call_later(pause, self._go_on)

    def _drop_unread(self) -> None:
        self._unread = b""
        if self._next is not None:
            self._next.cancel()

    def _check_progress(self) -> None:
        """End a connection whose request does not come, or whose client does not read the answer."""
        if isinstance(self._protocol, SocketProtocol) and self._protocol.handshake_complete:
            return  # pings and the backlog of its session end it
        unsent = self.transport.get_write_buffer_size()
        seen, unread = self._before
        if (self._protocol.is_waiting and seen == self._protocol.parts) or unsent >= unread > 0:
            self.transport.abort()
            return
        self._before = self._protocol.parts, unsent
        self._check = self._loop.call_later(OPENING, self._check_progress)


class _Transport:
    """A connection's transport as its protocol sees it."""

    def __init__(self, transport: asyncio.Transport, connection: Connection) -> None:
        self._transport = transport
        self.write = transport.write  # attributes of its own are found faster
        self.get_write_buffer_size = transport.get_write_buffer_size
        self.pause_reading = connection.pause_reading
        self.resume_reading = connection.resume_reading
        self.set_protocol = connection.switch
        self.connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)


class HttpProtocol(H11Protocol):
    """Requests and answers.

    Attributes:
        parts: how many parts of requests have come.
    """

    slice = HTTP_SLICE

    def __init__(self, connection: Connection, **named: Any) -> None:
        super().__init__(**named)
        self._connection = connection
        self._bytes = 0
        self.conn: _HttpParser = _HttpParser(h11.SERVER)

    @property
    def parts(self) -> int:
        return self.conn.parts

    @property
    def is_waiting(self) -> bool:
        """Whether a request is awaited, or the rest of its head."""
        return self.conn.their_state is h11.IDLE

    def data_received(self, data: bytes) -> None:
        self.server_state.default_headers = [(b"date", formatdate(usegmt=True).encode())]
        super().data_received(data)
        self._bytes += len(data)
        if self.parts > FEW_PARTS + self._bytes / LEAST_PART:
            self._connection.counts["http_errors"] += 1
            self.transport.abort()

    def warn(self, notice: str) -> None:
        """Say nothing: the client waits for its answer."""

    def send_400_response(self, msg: str) -> None:
        self._connection.counts["http_errors"] += 1
        super().send_400_response(msg)


class _HttpParser(h11.Connection):
    parts = 0

    def next_event(self) -> Any:
        event = super().next_event()
        self.parts += event is not h11.NEED_DATA and event is not h11.PAUSED
        return event


class SocketProtocol(WebSocketsSansIOProtocol):
    """A WebSocket, and its `Output` for the application: messages go directly to the socket's buffer.

    Attributes:
        warn: takes a text for the client when it begins to exceed the rate.
        parts: how many frames have come.
    """

    slice = SLICE
    warn: Callable[[str], None] = staticmethod(lambda notice: None)

    def __init__(self, **named: Any) -> None:
        super().__init__(**named)
        self.close_timeout = GOODBYE

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self.conn: _FrameParser = _FrameParser(transport.connection.counts, max_size=self.config.ws_max_size)

    @property
    def parts(self) -> int:
        return self.conn.parts

    @property
    def is_waiting(self) -> bool:
        return not self.handshake_initiated

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        if (fault := self.conn.handshake_exc) is not None and not self.handshake_initiated:
            # uvicorn waits for another request.
            words = f"wanted GET, in HTTP/1.1 and without a body: {fault.__cause__ or fault}\n"
            response = self.conn.reject(400, words)
            self.transport.write(response.serialize())
            self.transport.close()

    async def run_asgi(self) -> None:
        self.scope["extensions"][EXTENSION] = self  # type: ignore[assignment]
        await super().run_asgi()

    @property
    def unsent_bytes(self) -> int:
        return self.transport.get_write_buffer_size()

    def put(self, data: str | bytes) -> None:
        """Send a message; none after the end."""
        if self.conn.state is State.OPEN and not self.disconnected:
            payload = data.encode() if isinstance(data, str) else data
            self.transport.write(_head(isinstance(data, str), len(payload)) + payload)

    async def flush(self) -> None:
        """Wait until the network can take more."""
        await self.writable.wait()

    async def send(self, message: Any) -> None:
        if message["type"] == "websocket.close":
            # A client that does not read is disconnected.
            self.writable.set()
            self.loop.call_later(GOODBYE, self.transport.abort)
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and not message.get("more_body"):
            self.handshake_complete = True  # otherwise uvicorn logs an error for each refusal


class _FrameParser(ServerProtocol):
    parts = 0

    def __init__(self, counts: Counter[str], **named: Any) -> None:
        super().__init__(**named)
        self._counts = counts

    def events_received(self) -> list[Event]:
        events = super().events_received()
        frames = [event for event in events if isinstance(event, Frame)]
        self.parts += len(frames)
        self._counts["control_frames"] += sum(frame.opcode in CTRL_OPCODES for frame in frames)
        return events


@lru_cache(maxsize=1024)
def _head(text: bool, length: int) -> bytes:
    frame = Frame(Opcode.TEXT if text else Opcode.BINARY, bytes(length)).serialize(mask=False)
    return frame[: len(frame) - length]
