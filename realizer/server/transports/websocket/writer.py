"""The writer of a session's messages to one WebSocket, without waiting."""

from __future__ import annotations

import asyncio
from functools import lru_cache

from websockets.asyncio.server import ServerConnection
from websockets.frames import Frame, Opcode
from websockets.protocol import State

# A client that has not answered the close by then is gone.
GOODBYE = 2.0  # s
REASON = 123  # bytes that a close frame has room for behind its code


class WebSocketClient:
    """The way out to one WebSocket: what is sent is written at once, or waits in the socket's own buffer."""

    def __init__(self, socket: ServerConnection) -> None:
        self._socket = socket
        self._end: asyncio.Task[None] | None = None

    @property
    def waiting(self) -> int:
        transport = self._socket.transport
        return 0 if transport is None else transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        # Without a task that wakes for every frame; a socket that closes is left out.
        if self._end is None and self._socket.protocol.state is State.OPEN:
            text = isinstance(data, str)
            payload = data.encode() if isinstance(data, str) else data
            self._socket.transport.write(_head(text, len(payload)) + payload)

    def end(self, code: int, reason: str) -> None:
        if self._end is None:
            self._end = asyncio.get_running_loop().create_task(self.close(code, reason))

    async def close(self, code: int, reason: str) -> None:
        """Let it go, and wait until it is gone; one that does not read will never hear of it.

        Args:
            reason: as much of it is told as there is room for.
        """
        reason = reason.encode()[:REASON].decode(errors="ignore")
        try:
            async with asyncio.timeout(GOODBYE):
                await self._socket.close(code, reason)
        except TimeoutError:
            self._socket.transport.abort()


@lru_cache(maxsize=1024)
def _head(text: bool, length: int) -> bytes:
    """What goes before a message of so many bytes."""
    whole = Frame(Opcode.TEXT if text else Opcode.BINARY, bytes(length)).serialize(mask=False)
    return whole[: len(whole) - length]
