"""WebSockets by the websockets library: requests that are no GET, limits of what is read, and clients."""

import asyncio
import contextlib
from collections import Counter
from collections.abc import Callable, Generator, Mapping
from functools import lru_cache
from typing import Any

from websockets.asyncio.server import Server, ServerConnection
from websockets.exceptions import ConnectionClosed, InvalidMessage
from websockets.frames import CTRL_OPCODES, Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import Event, State
from websockets.server import ServerProtocol

from realizer.core.settings import limit_hint
from realizer.server.http.requests import address_of, headers_of

GOODBYE = 2.0  # s; a client that has not answered a close frame by then is gone
REASON = 123  # bytes of a reason in a close frame
LONGEST_METHOD = 8  # characters, with the blank after it
POST = (
    "there is nothing to POST to: send BML through the WebSocket at /ws, or run uvicorn realizer.asgi:app\n"
)
OTHERS = "wanted GET or HEAD\n"
SLICE = 4 * 1024  # bytes that are parsed before others have their turn: 3 ms of empty frames
UNIT = 16 * 1024  # bytes that count as much as a frame


class Protocol(ServerProtocol):
    """The protocol of a connection."""

    def __init__(self, counts: Counter[str], **options: Any) -> None:
        super().__init__(**options)
        self._counts = counts
        self._has_answered = False
        self._wants_body = True

    def parse(self) -> Generator[None]:
        """Parse what the client sends. Refuse other methods here: the library cannot read their bodies."""
        if self.state is State.CONNECTING:
            while not (head := bytes(self.reader.buffer[:LONGEST_METHOD])).count(b" "):
                if len(head) == LONGEST_METHOD or self.reader.eof:
                    break
                yield
            method, blank, _ = head.partition(b" ")
            if blank and method == b"HEAD":  # answered as GET, without the body
                self.reader.buffer[: len(method)] = b"GET"
                self._wants_body = False
            elif blank and method.isalpha() and method != b"GET":
                self._refuse(method)
                yield
        yield from super().parse()

    def send_response(self, response: Response) -> None:
        self._has_answered = True
        if response.status_code >= 400:
            self._counts["http_errors" if response.status_code < 500 else "http_failures"] += 1
        if not self._wants_body:
            response.body = b""
        super().send_response(response)

    def send_eof(self) -> None:
        """Answer a request that is none or has a body. The library ends the connection without a word."""
        fault = self.handshake_exc and self.handshake_exc.__cause__
        if fault is None or self.reader.eof or self._has_answered:
            super().send_eof()
        else:
            self.send_response(self.reject(400, f"wanted GET, in HTTP/1.1 and without a body: {fault}\n"))

    def _refuse(self, method: bytes) -> None:
        response = self.reject(*((404, POST) if method == b"POST" else (405, OTHERS)))
        response.headers["Allow"] = "GET, HEAD"
        self.handshake_exc = InvalidMessage(f"wanted GET, got {method.decode()}")
        self.send_response(response)


class RateLimiter:
    """A limit of the rate at which the messages of a client are read.

    Args:
        rate: messages a second; after a pause twice as many may come at once.

    Attributes:
        notice: a text for the client when it begins to exceed the rate, otherwise None.
    """

    def __init__(self, rate: float) -> None:
        self.notice: str | None = None
        self._rate = rate
        self._was_limited = False
        self._free = float("-inf")  # when all messages so far would have arrived at that rate

    def wait(self, now: float, count: float = 1.0) -> float:
        """Return the seconds to wait after a message, or several, that arrived `now`."""
        self._free = max(self._free, now) + count / self._rate
        pause = max(0.0, self._free - now - 2.0)
        words = (
            f"wanted at most {self._rate:g} messages a second; more are read later {limit_hint('max_rate')}"
        )
        self.notice = words if pause and not self._was_limited else None
        self._was_limited = bool(pause)
        return pause

    async def pause(self, warn: Callable[[str], None], count: float = 1.0) -> None:
        """Wait as long as the message that was just read, or several, demand.

        Others run in between also if that is 0: one read may hold many messages, which must not delay the
        frames of other clients.
        """
        seconds = self.wait(asyncio.get_running_loop().time(), count)
        if self.notice is not None:
            warn(self.notice)
        await asyncio.sleep(seconds)


class Connection(ServerConnection):
    """A connection that reads at a limited rate, in slices between which others have their turn.

    Every frame counts, also control frames and fragments, and so does every `UNIT` of bytes.

    Args:
        rate: frames a second; after a pause twice as many may come at once.

    Attributes:
        warn: takes a text for the client when it begins to exceed the rate.
    """

    def __init__(
        self, protocol: ServerProtocol, server: Server, rate: float, counts: Counter[str], **options: Any
    ) -> None:
        super().__init__(protocol, server, **options)
        self.warn: Callable[[str], None] = lambda text: None
        self._limiter = RateLimiter(rate)
        self._counts = counts
        self._frames = 0
        self._unread = b""
        self._next: asyncio.Handle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        # The library resumes reading when its queue of messages is short. The rate must allow it, too.
        self.recv_messages.resume = self._go_on_later

    def connection_lost(self, exc: Exception | None) -> None:
        self._drop_unread()
        super().connection_lost(exc)

    def eof_received(self) -> None:
        self._drop_unread()
        super().eof_received()

    def data_received(self, data: bytes) -> None:
        self._unread += data
        if self._next is None:
            self._go_on()
        else:
            self.transport.pause_reading()

    def process_event(self, event: Event) -> None:
        if isinstance(event, Frame):
            self._frames += 1
            self._counts["control_frames"] += event.opcode in CTRL_OPCODES
        super().process_event(event)

    def _go_on(self) -> None:
        """Parse a slice of what has come; read more when all of it is parsed and the rate allows it."""
        self._next = None
        if self._unread and not self.recv_messages.paused:
            part, self._unread = self._unread[:SLICE], self._unread[SLICE:]
            before = self._frames
            super().data_received(part)
            frames = self._frames - before
            pause = 0.0
            if self.request is not None:
                pause = self._limiter.wait(self.loop.time(), frames + len(part) / UNIT)
            if self._limiter.notice is not None:
                self._counts["rate_exceeded"] += 1
                self.warn(self._limiter.notice)
            if pause or self._unread:
                self._go_on_later(pause)
        if self.transport.is_closing():
            self._drop_unread()
        elif self._next or self.recv_messages.paused:
            self.transport.pause_reading()
        else:
            self.transport.resume_reading()

    def _go_on_later(self, pause: float = 0.0) -> None:
        if self._next is None:
            self._next = self.loop.call_later(pause, self._go_on)

    def _drop_unread(self) -> None:
        self._unread = b""
        if self._next is not None:
            self._next.cancel()


class WebSocketClient:
    """A `ClientSocket` of the websockets library: data goes directly to the socket's own buffer."""

    def __init__(self, socket: ServerConnection) -> None:
        self._socket = socket
        self._end: asyncio.Task[None] | None = None
        self.address, request = address_of(socket), socket.request
        assert request is not None
        self.target = request.path
        self.headers: Mapping[str, str] = headers_of(request)

    @property
    def close_code(self) -> int | None:
        return self._socket.close_code

    def on_rate(self, warn: Callable[[str], None]) -> None:
        if isinstance(self._socket, Connection):
            self._socket.warn = warn

    async def receive(self) -> str | bytes | None:
        try:
            return await self._socket.recv()
        except ConnectionClosed:
            return None

    async def send_all(self, text: str | bytes) -> None:
        with contextlib.suppress(ConnectionClosed):
            await self._socket.send(text)

    @property
    def unsent_bytes(self) -> int:
        transport = self._socket.transport
        return 0 if transport is None else transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        # Past the library's `send`, which needs a task for each message.
        if self._end is None and self._socket.protocol.state is State.OPEN:
            text = isinstance(data, str)
            payload = data.encode() if isinstance(data, str) else data
            self._socket.transport.write(_head(text, len(payload)) + payload)

    def disconnect(self, code: int, reason: str) -> None:
        if self._end is None:
            self._end = asyncio.get_running_loop().create_task(self.close(code, reason))

    async def close(self, code: int, reason: str) -> None:
        """Close the WebSocket and wait until it is closed. A client that does not read is disconnected.

        Args:
            reason: is cut to what a close frame has room for.
        """
        reason = reason.encode()[:REASON].decode(errors="ignore")
        try:
            async with asyncio.timeout(GOODBYE):
                await self._socket.close(code, reason)
        except TimeoutError:
            self._socket.transport.abort()


@lru_cache(maxsize=1024)
def _head(text: bool, length: int) -> bytes:
    frame = Frame(Opcode.TEXT if text else Opcode.BINARY, bytes(length)).serialize(mask=False)
    return frame[: len(frame) - length]
