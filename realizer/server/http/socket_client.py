"""A WebSocket of an ASGI server as a client of sessions."""

import asyncio
import contextlib
from collections.abc import Callable, Mapping

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from realizer.core.settings import Settings, limit_hint
from realizer.server.transports.websocket.protocol import GOODBYE, REASON, UNIT, RateLimiter


class SocketClient:
    """A `ClientSocket` of an ASGI server: data waits in a queue that a task sends.

    The rate of messages and bytes is limited as by `protocol.Connection`; control frames are the server's.
    """

    def __init__(self, socket: WebSocket, target: str, address: str, settings: Settings) -> None:
        self.address = address
        self.target = target
        self.headers: Mapping[str, str] = dict(socket.headers)
        self.close_code: int | None = None
        self._socket = socket
        self._limiter = RateLimiter(settings.max_rate)
        self._most = settings.max_message
        self._warn: Callable[[str], None] = lambda notice: None
        self._queue: asyncio.Queue[str | bytes | None] = asyncio.Queue()  # None after the last message
        self.unsent_bytes = 0
        self._ending = False
        self._end: asyncio.Task[None] | None = None
        self._writing = asyncio.create_task(self._write())

    def on_rate(self, warn: Callable[[str], None]) -> None:
        self._warn = warn

    def send(self, data: str | bytes) -> None:
        if not self._ending and self.close_code is None:
            self._queue.put_nowait(data)
            self.unsent_bytes += len(data)

    async def send_all(self, text: str | bytes) -> None:
        self.send(text)
        await self._queue.join()

    async def receive(self) -> str | bytes | None:
        if self.close_code is not None or self._socket.client_state is not WebSocketState.CONNECTED:
            return None
        message = await self._socket.receive()
        if message["type"] == "websocket.disconnect":
            self.close_code = message.get("code", 1005)
            return None
        text, data = message.get("text"), message.get("bytes")
        got: str | bytes = (data or b"") if text is None else text
        if len(got) > self._most:
            words = f"wanted messages of at most {self._most} bytes {limit_hint('max_message')}"
            await self.close(1009, words)
            return None
        await self._limiter.pause(self._warn, 1 + len(got) / UNIT)
        return got

    def disconnect(self, code: int, reason: str) -> None:
        if self._end is None:
            self._ending = True
            self._end = asyncio.create_task(self.close(code, reason))

    async def close(self, code: int, reason: str) -> None:
        """Send what waits, at most for `GOODBYE` seconds, and close the connection."""
        self._ending = True
        self._queue.put_nowait(None)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(GOODBYE):
                await asyncio.shield(self._writing)
        if self.close_code is None:
            self.close_code = code
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await self._socket.close(code, reason.encode()[:REASON].decode(errors="ignore"))

    async def finish(self) -> None:
        """End the tasks, because the connection is over, and read the rest: a server may wait for that."""
        with contextlib.suppress(TimeoutError, RuntimeError):
            async with asyncio.timeout(GOODBYE):
                while self._socket.client_state is WebSocketState.CONNECTED:
                    await self._socket.receive()
        self._writing.cancel()
        for task in (self._writing, self._end):
            if task is not None:
                await asyncio.gather(task, return_exceptions=True)

    async def _write(self) -> None:
        while (data := await self._queue.get()) is not None:
            try:
                if self.close_code is None:
                    field = "text" if isinstance(data, str) else "bytes"
                    await self._socket.send({"type": "websocket.send", field: data})
            except (RuntimeError, WebSocketDisconnect):
                self.close_code = self.close_code or 1006
            self.unsent_bytes -= len(data)
            self._queue.task_done()
