"""WebSocket connections: admission, session, messages; whichever library serves them."""

import asyncio
import contextlib
import http
import logging
from collections.abc import Awaitable, Callable, Iterator, Mapping
from functools import partial
from urllib.parse import parse_qsl

from realizer.core.settings import Settings, limit_hint
from realizer.core.similar import did_you_mean, similar
from realizer.protocol.messages.replies import ErrorCode, ErrorMessage
from realizer.server.editors import EDITORS, answer_of, editor_of
from realizer.server.http import access
from realizer.server.http.access import AccessControl, Grant
from realizer.server.http.socket_client import SocketClient
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor

log = logging.getLogger(__name__)

# Status of a refusal that another try does not mend -> code of the error about it.
REFUSALS: Mapping[int, ErrorCode] = {400: "invalid", 401: "token", 403: "token"}
PARAMETERS = frozenset({"session", "seen", "token"})  # of a WebSocket's address; others are ignored
SOCKETS = ("/ws", "/check", *(f"/{name}" for name in EDITORS))  # paths of WebSockets


class WebSocketConnections:
    """The handler of the service's WebSocket connections."""

    def __init__(self, sessions: SessionHost, settings: Settings, access: AccessControl) -> None:
        self._sessions = sessions
        self._settings = settings
        self._access = access
        self._work: dict[str, Callable[[SocketClient], Awaitable[None]]] = {
            "/check": self._check,
            **{f"/{name}": partial(self._edit, name, asyncio.Lock()) for name in EDITORS},
        }
        self._checking = asyncio.Lock()
        self._from: list[str] = []  # the addresses of the open connections
        self._clients: set[SocketClient] = set()

    def admit(self, target: str, headers: Mapping[str, str], address: str) -> None:
        """Check whether a WebSocket may be opened at one of `SOCKETS`.

        A page cannot read why it was not opened, so its session and token are checked only after that.

        Raises:
            JoinError: the client may not open it.
        """
        works = target.partition("?")[0] in self._work
        if not works and "origin" in headers and self._access.allows_origin(headers):
            self._check_room(address)
            return
        grant = self._access.request(target, headers, later=not works)
        self._check_room(address)
        if works:
            self._access.check_memory()
        else:
            # Without a grant its sessions are not known yet.
            visitor = Visitor(address, None if grant is None else grant.sessions)
            self._sessions.check(session_of(target)[0], visitor)

    @contextlib.contextmanager
    def place(self, address: str) -> Iterator[None]:
        """Count a connection from an address, such as a WebSocket, as long as it lasts.

        Raises:
            JoinError: too many are open.
        """
        self._check_room(address)
        self._from.append(address)
        try:
            yield
        finally:
            self._from.remove(address)

    def _check_room(self, address: str) -> None:
        most = self._settings.max_connections
        if self._from.count(address) >= most:
            words = f"{most} connections from {address} are open: wanted fewer"
            raise JoinError(http.HTTPStatus.TOO_MANY_REQUESTS, f"{words} {limit_hint('max_connections')}")

    async def serve(self, client: SocketClient) -> None:
        """Serve one WebSocket until it closes."""
        serve = self._work.get(client.target.partition("?")[0], self._serve)
        try:
            with self.place(client.address):  # others may have connected since the HTTP request
                self._clients.add(client)
                await serve(client)
        except JoinError as error:
            await client.close(1013, str(error))
        finally:
            self._clients.discard(client)

    async def close(self, code: int, reason: str) -> None:
        """Close all WebSockets."""
        await asyncio.gather(*(client.close(code, reason) for client in self._clients))

    async def _serve(self, client: SocketClient) -> None:
        hello = None
        try:
            grant = self._access.request(client.target, client.headers, later=True)
            if grant is None:
                hello, grant = await self._first_message(client)
            # What a token for some sessions allows must not change others.
            visitor = Visitor(client.address, grant.sessions, may_edit=grant.sessions is None)
            name, seen = session_of(client.target)
            self._sessions.check(name, visitor)  # again: the grant of a hello is known only now
            await self._sessions.restore(name, seen)
            number = self._sessions.join(client, name, seen, visitor)
        except JoinError as error:
            await self._reject(client, error)
            return
        except JournalError as error:
            await client.close(1013, str(error))
            return
        fields = {"connection": number, "session": name, "address": client.address}
        log.info("joined", extra=fields)
        try:
            if hello is not None:
                self._sessions.receive(number, hello)
            async with asyncio.timeout(grant.seconds_left):
                await self._read(client, number)
        except TimeoutError:
            await client.close(1008, "token: it has expired")
        finally:
            self._sessions.leave(number)
            log.info("left", extra={**fields, "code": client.close_code})

    async def _read(self, client: SocketClient, number: int) -> None:
        """Pass on messages, whose rate the client's socket limits."""
        client.on_rate(lambda notice: client.send(ErrorMessage(code="rate", message=notice).text()))
        while (message := await client.receive()) is not None:
            if not self._sessions.receive(number, message):
                return
            await asyncio.sleep(0)  # one read may hold many messages
            await self._sessions.wait_for_room(number)

    async def _first_message(self, client: SocketClient) -> tuple[str | bytes, Grant]:
        """Return the first message of a client without a token, and the grant of the token in it.

        Raises:
            JoinError: 401, no message came in time, or it has no valid token.
        """
        message: str | bytes = ""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(access.PATIENCE):
                message = await client.receive() or ""
        return message, self._access.check_hello(message)

    async def _reject(self, client: SocketClient, error: JoinError) -> None:
        self._sessions.metrics.counts["refused"] += 1
        self._access.log_refusal(error, client.address)
        code = REFUSALS.get(error.status)
        if code is not None:
            where = "hello.token" if error.status == http.HTTPStatus.UNAUTHORIZED else "hello.session"
            message = ErrorMessage(code=code, message=str(error), where=where)
            await client.send_all(message.text())
        await client.close(1013 if code is None else 1008, str(error))

    async def _check(self, client: SocketClient) -> None:
        """Serve the WebSocket of a text: answer each version that arrives by its faults."""
        from realizer.server.http.page_tools import lint

        loop = asyncio.get_running_loop()
        while (text := await client.receive()) is not None:
            if isinstance(text, bytes):
                await client.close(1003, "wanted text")
                return
            # One text at a time for all pages: sessions come first.
            async with self._checking:
                found = await loop.run_in_executor(None, lint, text, self._settings)
            await client.send_all(found)

    async def _edit(self, name: str, turn: asyncio.Lock, client: SocketClient) -> None:
        """Serve the WebSocket of an editor: answer the messages of a page in their order."""
        grant = self._access.request(client.target, client.headers)
        may_save = grant is not None and grant.sessions is None
        loop = asyncio.get_running_loop()
        make = partial(editor_of, name, self._settings, may_save=may_save)
        editor = await loop.run_in_executor(None, make)
        try:
            while (message := await client.receive()) is not None:
                async with turn:  # one at a time for all pages, because each may take seconds
                    answer = await loop.run_in_executor(None, answer_of, editor, message)
                await client.send_all(answer)
        finally:
            await loop.run_in_executor(None, editor.close)


def session_of(target: str) -> tuple[str | None, int | None]:
    """Return the session and the number in `?session=ID&seen=N`.

    Raises:
        JoinError: 400, `seen` is not a number, or a parameter is a misspelt one.
    """
    # Of several values with one name the last.
    query = dict(parse_qsl(target.partition("?")[2], keep_blank_values=True))
    for name in sorted(query.keys() - PARAMETERS)[:8]:
        if near := did_you_mean(similar(name, PARAMETERS, most=1, cutoff=0.7)):
            raise JoinError(400, f"the address has an unknown parameter {name[:80]!r}{near}")
    session, seen = query.get("session") or None, query.get("seen")
    if seen is None:
        return session, None
    if not (seen.isascii() and seen.isdigit() and len(seen) < 16):
        raise JoinError(400, f"seen: wanted the number of the last feedback that came, got {seen[:80]!r}")
    return session, int(seen)
