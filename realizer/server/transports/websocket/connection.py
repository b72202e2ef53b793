"""One WebSocket connection: admission, session, messages."""

from __future__ import annotations

import asyncio
import contextlib
import http
import logging
from collections import Counter
from functools import lru_cache
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State

from realizer.core.settings import Settings, raises
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.http import access
from realizer.server.http.access import AccessControl, RateLimiter
from realizer.server.http.jwt_tokens import Grant
from realizer.server.journal import JournalError
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.transport import Sessions
from realizer.server.transports.websocket.request import address_of, headers_of, session_of, visitor_of

log = logging.getLogger(__name__)

# A client that has not answered the close by then is gone.
GOODBYE = 2.0  # s
REASON = 123  # bytes that a close frame has room for behind its code


class WebSocketConnections:
    """Lets clients into sessions as `guard` says, and reads them as fast as `settings` say."""

    def __init__(self, sessions: Sessions, settings: Settings, access: AccessControl) -> None:
        self._sessions = sessions
        self._settings = settings
        self._access = access
        self._checking = asyncio.Lock()
        self._from: Counter[str] = Counter()  # address -> WebSockets that are open

    def check_room(self, socket: ServerConnection) -> None:
        """Whether one more may come from its address: nobody can take the room of all others.

        Raises:
            HubError: there are too many.
        """
        most = self._settings.max_connections
        if self._from[address_of(socket)] >= most:
            words = (
                f"{most} connections from {address_of(socket)} are open: wanted fewer "
                f"{raises('max_connections')}"
            )
            raise JoinError(http.HTTPStatus.TOO_MANY_REQUESTS, words)

    async def handle(self, socket: ServerConnection) -> None:
        """One WebSocket, from its opening to its end."""
        assert socket.request is not None
        address = address_of(socket)
        try:
            self.check_room(socket)  # again: many may have been let in at the same moment
        except JoinError as error:
            await WebSocketWriter(socket).close(1013, str(error))
            return
        self._from[address] += 1
        try:
            if urlsplit(socket.request.path).path == "/check":
                await self._check(socket)
            else:
                await self._visit(socket, socket.request)
        finally:
            self._from[address] -= 1
            if not self._from[address]:
                del self._from[address]

    async def _visit(self, socket: ServerConnection, request: Request) -> None:
        """One visit, to its end; who may not come in is told why."""
        client = WebSocketWriter(socket)
        greeting = None
        try:
            allowed = self._access.request(request.path, headers_of(request), later=True)
            if allowed is None:
                greeting, allowed = await self._first_message(socket)
            visitor = visitor_of(socket, allowed)
            name, seen = session_of(request)
            self._sessions.check(name, visitor)  # who greets is known only now
            await self._sessions.restore(name, seen)
            number = self._sessions.join(client, name, seen, visitor)
        except JoinError as error:
            await self._reject(socket, client, error)
            return
        except JournalError as error:
            await client.close(1013, str(error))
            return
        told = {"connection": number, "session": name, "address": address_of(socket)}
        log.info("joined", extra=told)
        try:
            if greeting is not None:
                self._sessions.receive(number, greeting)
            async with asyncio.timeout(allowed.seconds_left):
                await self._read(socket, number, client)
        except ConnectionClosed:
            pass
        except TimeoutError:
            await client.close(1008, "token: it has expired")
        finally:
            self._sessions.leave(number)
            log.info("left", extra={**told, "code": socket.close_code})

    async def _read(self, socket: ServerConnection, number: int, client: WebSocketWriter) -> None:
        """Hand messages on, no faster than a client may send them: the rest waits in its own buffers."""
        loop = asyncio.get_running_loop()
        pace = RateLimiter(self._settings.max_rate)
        async for message in socket:
            if not self._sessions.receive(number, message):
                return
            # 0 too: messages that are there already must not hold up everybody else.
            pause = pace.wait(loop.time())
            if pace.notice is not None:
                client.send(ErrorMessage(code="rate", message=pace.notice).text())
            await asyncio.sleep(pause)

    async def _first_message(self, socket: ServerConnection) -> tuple[str | bytes, Grant]:
        """The first message of a client that has not brought a token yet, and what its token lets it do.

        Raises:
            HubError: 401, it has said nothing, or something else.
        """
        message: str | bytes = ""
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            async with asyncio.timeout(access.PATIENCE):
                message = await socket.recv()
        return message, self._access.check_hello(message)

    async def _reject(self, socket: ServerConnection, client: WebSocketWriter, error: JoinError) -> None:
        """Say why one who is here already may not stay."""
        self._sessions.metrics.counts["refused"] += 1
        log.info("refused: %s", error, extra={"address": address_of(socket), "status": error.status})
        unknown = error.status in (http.HTTPStatus.UNAUTHORIZED, http.HTTPStatus.FORBIDDEN)
        if unknown:
            where = "hello.token" if error.status == http.HTTPStatus.UNAUTHORIZED else "hello.session"
            told = ErrorMessage(code="token", message=str(error), where=where)
            with contextlib.suppress(ConnectionClosed):
                await socket.send(told.text())
        await client.close(1008 if unknown else 1013, str(error))

    async def _check(self, socket: ServerConnection) -> None:
        """An editor's own WebSocket: a text in, its faults out, one after the other."""
        from realizer.server.http.page_tools import lint

        loop = asyncio.get_running_loop()
        with contextlib.suppress(ConnectionClosed):
            async for text in socket:
                if isinstance(text, bytes):
                    await socket.close(1003, "wanted text")
                    return
                # One text at a time, whoever asks: those that play come first.
                async with self._checking:
                    told = await loop.run_in_executor(None, lint, text, self._settings)
                await socket.send(told)


class WebSocketWriter:
    """The way out to one WebSocket: what is sent is written at once, or waits in the socket's own buffer."""

    def __init__(self, socket: ServerConnection) -> None:
        self._socket = socket
        self._end: asyncio.Task[None] | None = None

    @property
    def unsent_bytes(self) -> int:
        transport = self._socket.transport
        return 0 if transport is None else transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        # Without a task that wakes for every frame; a socket that closes is left out.
        if self._end is None and self._socket.protocol.state is State.OPEN:
            text = isinstance(data, str)
            payload = data.encode() if isinstance(data, str) else data
            self._socket.transport.write(_head(text, len(payload)) + payload)

    def disconnect(self, code: int, reason: str) -> None:
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
