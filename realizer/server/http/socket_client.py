"""A WebSocket of an ASGI server as a client of sessions."""

import asyncio
import contextlib
from collections.abc import Callable, Mapping
from typing import Protocol

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from realizer.core.settings import Settings, limit_hint
from realizer.server.http.protocols import EXTENSION, GOODBYE
from realizer.server.transports.rate_limiter import UNIT, RateLimiter

REASON = 123  # bytes of a reason in a close frame


class Output(Protocol):
    """The way of messages to a WebSocket."""

    warn: Callable[[str], None]

    @property
    def unsent_bytes(self) -> int:
        """Bytes that wait for the network."""

    def put(self, data: str | bytes) -> None:
        """Send a message; none after the end. Never blocks."""

    async def flush(self) -> None:
        """Wait until the network has taken the messages, or the connection has ended."""


class SocketClient:
    """An `Outbound` for a WebSocket, and the messages that come from it.

    Under the server of `realizer serve` messages go directly to the socket's buffer, and the server limits
    what is read. Under another ASGI server they wait in a queue that a task sends, and this class limits the
    rate of messages and bytes; control frames are the server's.

    Attributes:
        target: path and query of its request.
        headers: of its request, by lower-case names.
        close_code: the code with which it was closed, or None.
    """

    def __init__(self, socket: WebSocket, target: str, address: str, settings: Settings) -> None:
        self.address = address
        self.target = target
        self.headers: Mapping[str, str] = dict(socket.headers)
        self.close_code: int | None = None
        self._socket = socket
        self._most = settings.max_message
        direct: Output | None = (socket.scope.get("extensions") or {}).get(EXTENSION)
        self._limiter = RateLimiter(settings.max_rate) if direct is None else None
        self._output = direct or _Queue(socket)
        self._is_ending = False
        self._end: asyncio.Task[None] | None = None

    @property
    def unsent_bytes(self) -> int:
        return self._output.unsent_bytes

    def on_rate(self, warn: Callable[[str], None]) -> None:
        """Call `warn` with a notice when the client sends too fast."""
        self._output.warn = warn

    def send(self, data: str | bytes) -> None:
        if not self._is_ending and self.close_code is None:
            self._output.put(data)

    async def send_all(self, text: str | bytes) -> None:
        """Send a message, and wait until the network has taken it, or the connection has ended."""
        self.send(text)
        await self._output.flush()

    async def receive(self) -> str | bytes | None:
        """Return the next message; None after the last."""
        if self.close_code is not None or self._socket.client_state is not WebSocketState.CONNECTED:
            return None
        message = await self._socket.receive()
        if message["type"] == "websocket.disconnect":
            self.close_code = message.get("code", 1005)
            return None
        text, data = message.get("text"), message.get("bytes")
        got: str | bytes = (data or b"") if text is None else text
        if self._limiter is not None:
            if len(got) > self._most:
                words = f"wanted messages of at most {self._most} bytes {limit_hint('max_message')}"
                await self.close(1009, words)
                return None
            await self._limiter.pause(self._output.warn, 1 + len(got) / UNIT)
        return got

    def disconnect(self, code: int, reason: str) -> None:
        if self._end is None:
            self._is_ending = True
            self._end = asyncio.create_task(self.close(code, reason))

    async def close(self, code: int, reason: str) -> None:
        """Send what waits, at most for `GOODBYE` seconds, and close the connection."""
        self._is_ending = True
        if isinstance(self._output, _Queue):
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(GOODBYE):
                    await self._output.flush()
        if self.close_code is None:
            self.close_code = code
            with contextlib.suppress(TimeoutError, RuntimeError, WebSocketDisconnect):
                async with asyncio.timeout(GOODBYE):
                    await self._socket.close(code, reason.encode()[:REASON].decode(errors="ignore"))

    async def finish(self) -> None:
        """End the tasks, because the connection is over, and read the rest: a server may wait for that."""
        with contextlib.suppress(TimeoutError, RuntimeError):
            async with asyncio.timeout(GOODBYE):
                while self._socket.client_state is WebSocketState.CONNECTED:
                    await self._socket.receive()
        if isinstance(self._output, _Queue):
            self._output.writing.cancel()
            await asyncio.gather(self._output.writing, return_exceptions=True)
        if self._end is not None:
            await asyncio.gather(self._end, return_exceptions=True)


class _Queue:
    """The `Output` under a server that must be awaited."""

    def __init__(self, socket: WebSocket) -> None:
        self.warn: Callable[[str], None] = lambda notice: None
        self.unsent_bytes = 0
        self._socket = socket
        self._queue: asyncio.Queue[str | bytes] = asyncio.Queue()
        self.writing = asyncio.create_task(self._write())

    def put(self, data: str | bytes) -> None:
        self._queue.put_nowait(data)
        self.unsent_bytes += len(data)

    async def flush(self) -> None:
        await self._queue.join()

    async def _write(self) -> None:
        has_ended = False
        while True:
            data = await self._queue.get()
            try:
                if not has_ended:
                    field = "text" if isinstance(data, str) else "bytes"
                    await self._socket.send({"type": "websocket.send", field: data})
            except (RuntimeError, WebSocketDisconnect):
                has_ended = True
            self.unsent_bytes -= len(data)
            self._queue.task_done()
