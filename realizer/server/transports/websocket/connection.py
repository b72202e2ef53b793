"""WebSocket connections: admission, session, messages."""

from __future__ import annotations

import asyncio
import contextlib
import http
import logging
from functools import lru_cache

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State

from realizer.core.settings import Settings, limit_hint
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.http import access
from realizer.server.http.access import AccessControl
from realizer.server.http.jwt_tokens import Grant
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.server.transports.websocket.protocol import Connection
from realizer.server.transports.websocket.request import address_of, headers_of, path_of, session_of

log = logging.getLogger(__name__)

GOODBYE = 2.0  # s; a client that has not answered a close frame by then is gone
REASON = 123  # bytes of a reason in a close frame


class WebSocketConnections:
    """The handler of the service's WebSocket connections."""

    def __init__(self, sessions: SessionHost, settings: Settings, access: AccessControl) -> None:
        self._sessions = sessions
        self._settings = settings
        self._access = access
        self._checking = asyncio.Lock()
        self._from: list[str] = []  # the addresses of the open WebSockets

    def check_room(self, socket: ServerConnection) -> None:
        """Raise JoinError if too many connections of the client's address are open."""
        most = self._settings.max_connections
        if self._from.count(address_of(socket)) >= most:
            words = (
                f"{most} connections from {address_of(socket)} are open: wanted fewer "
                f"{limit_hint('max_connections')}"
            )
            raise JoinError(http.HTTPStatus.TOO_MANY_REQUESTS, words)

    async def handle(self, socket: ServerConnection) -> None:
        """Serve one WebSocket until it closes."""
        assert socket.request is not None
        address = address_of(socket)
        try:
            self.check_room(socket)  # again: others may have connected since the HTTP request
        except JoinError as error:
            await WebSocketWriter(socket).close(1013, str(error))
            return
        self._from.append(address)
        try:
            if path_of(socket.request) == "/check":
                await self._check(socket)
            else:
                await self._serve(socket, socket.request)
        finally:
            self._from.remove(address)

    async def _serve(self, socket: ServerConnection, request: Request) -> None:
        client, hello, address = WebSocketWriter(socket), None, address_of(socket)
        try:
            grant = self._access.request(request.path, headers_of(request), later=True)
            if grant is None:
                hello, grant = await self._first_message(socket)
            visitor = Visitor(address, grant.sessions)
            name, seen = session_of(request)
            self._sessions.check(name, visitor)  # again: the grant of a hello is known only now
            await self._sessions.restore(name, seen)
            number = self._sessions.join(client, name, seen, visitor)
        except JoinError as error:
            await self._reject(socket, client, error)
            return
        except JournalError as error:
            await client.close(1013, str(error))
            return
        fields = {"connection": number, "session": name, "address": address}
        log.info("joined", extra=fields)
        try:
            if hello is not None:
                self._sessions.receive(number, hello)
            async with asyncio.timeout(grant.seconds_left):
                await self._read(socket, number, client)
        except ConnectionClosed:
            pass
        except TimeoutError:
            await client.close(1008, "token: it has expired")
        finally:
            self._sessions.leave(number)
            log.info("left", extra={**fields, "code": socket.close_code})

    async def _read(self, socket: ServerConnection, number: int, client: WebSocketWriter) -> None:
        """Pass on messages; `Connection` limits their rate."""
        if isinstance(socket, Connection):
            socket.warn = lambda notice: client.send(ErrorMessage(code="rate", message=notice).text())
        async for message in socket:
            if not self._sessions.receive(number, message):
                return
            await asyncio.sleep(0)  # one read may hold many messages
            await self._sessions.wait_for_room(number)

    async def _first_message(self, socket: ServerConnection) -> tuple[str | bytes, Grant]:
        """Return the first message of a client without a token, and the grant of the token in it.

        Raises:
            JoinError: 401, no message came in time, or it has no valid token.
        """
        message: str | bytes = ""
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            async with asyncio.timeout(access.PATIENCE):
                message = await socket.recv()
        return message, self._access.check_hello(message)

    async def _reject(self, socket: ServerConnection, client: WebSocketWriter, error: JoinError) -> None:
        self._sessions.metrics.counts["refused"] += 1
        log.info("refused: %s", error, extra={"address": address_of(socket), "status": error.status})
        forbidden = error.status in (http.HTTPStatus.UNAUTHORIZED, http.HTTPStatus.FORBIDDEN)
        if forbidden:
            where = "hello.token" if error.status == http.HTTPStatus.UNAUTHORIZED else "hello.session"
            message = ErrorMessage(code="token", message=str(error), where=where)
            with contextlib.suppress(ConnectionClosed):
                await socket.send(message.text())
        await client.close(1008 if forbidden else 1013, str(error))

    async def _check(self, socket: ServerConnection) -> None:
        """Serve the WebSocket of an editor: send the faults of each text that arrives."""
        from realizer.server.http.page_tools import lint

        loop = asyncio.get_running_loop()
        with contextlib.suppress(ConnectionClosed):
            async for text in socket:
                if isinstance(text, bytes):
                    await socket.close(1003, "wanted text")
                    return
                # One text at a time for all editors: sessions come first.
                async with self._checking:
                    faults = await loop.run_in_executor(None, lint, text, self._settings)
                await socket.send(faults)


class WebSocketWriter:
    """The way out to one WebSocket, an `Outbound`: data goes directly to the socket's own buffer."""

    def __init__(self, socket: ServerConnection) -> None:
        self._socket = socket
        self._end: asyncio.Task[None] | None = None

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
    """Return the head of a frame of so many bytes."""
    frame = Frame(Opcode.TEXT if text else Opcode.BINARY, bytes(length)).serialize(mask=False)
    return frame[: len(frame) - length]
