"""The hub of an application: its sessions, who may use them, and what requests share."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from http import HTTPStatus
from typing import TYPE_CHECKING

from starlette.requests import HTTPConnection, Request

from realizer.core.settings import Settings, SettingsError, limit_hint
from realizer.server.http.access import ANY_GRANT, AccessControl, Grant
from realizer.server.http.connections import WebSocketConnections
from realizer.server.http.renderings import Renderings
from realizer.server.http.requests import HttpRequests
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.server.transports.transport import Outbound

if TYPE_CHECKING:
    from realizer.server.http.webrtc import Peers


class Hub:
    """The sessions of an application, which start with its first request or with its lifespan."""

    def __init__(self, settings: Settings) -> None:
        if settings.workers > 1:
            raise SettingsError("setting workers: an ASGI application is one process: wanted 1")
        self.settings = settings
        self.access = AccessControl(settings)
        self._starting: asyncio.Task[None] | None = None
        self.sessions: SessionHost

    async def ready(self) -> None:
        """Return when sessions can be joined.

        Raises:
            RealizerError, OSError: something that the settings name is missing.
        """
        if self._starting is None:
            self._starting = asyncio.create_task(self._start())
        await asyncio.shield(self._starting)

    async def _start(self) -> None:
        self.sessions = SessionHost(self.settings)
        await self.sessions.start()
        self.connections = WebSocketConnections(self.sessions, self.settings, self.access)
        self.requests = HttpRequests(self.sessions, self.settings, self.access)
        self.renderings = Renderings(self.settings)
        self.checking = asyncio.Lock()
        self.peers: Peers | None = None

    @contextlib.asynccontextmanager
    async def lifespan(self, _: object) -> AsyncIterator[None]:
        """Start the sessions; at the end wait at most `settings.drain` seconds for what plays."""
        await self.ready()
        try:
            yield
        finally:
            self.sessions.stop_accepting()
            await self.sessions.drain()
            if self.peers is not None:
                await self.peers.close()
            await self.sessions.close()
            self._starting = None

    def grant(self, connection: HTTPConnection) -> Grant:
        """Return what the token of a request allows.

        Raises:
            JoinError: 401 or 403, the client may not make it.
        """
        headers = dict(connection.headers)
        self.access.check_host(headers)
        return self.access.request(f"?{connection.url.query}", headers) or ANY_GRANT

    def open_peers(self) -> Peers:
        """Return the WebRTC peers.

        Raises:
            JoinError: 503, the extra is missing.
        """
        try:
            from realizer.server.http.webrtc import Peers
        except ImportError as error:
            if error.name is None or error.name.partition(".")[0] not in ("aiortc", "av"):
                raise
            words = "WebRTC: wanted the webrtc extra: pip install 'bml-realizer[webrtc]'"
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words) from None
        self.peers = self.peers or Peers(self.sessions)
        return self.peers

    def admit(self, connection: HTTPConnection) -> Visitor:
        """Return who makes a request; raises as `grant`."""
        return Visitor(address_of(connection), self.grant(connection).sessions)

    @contextlib.asynccontextmanager
    async def joined(
        self, client: Outbound, name: str, visitor: Visitor, seen: int | None = None
    ) -> AsyncIterator[int]:
        """Join a client to a session until the block ends; the value is the number of the connection.

        Raises:
            JoinError: the client may not join it.
        """
        try:
            self.sessions.check(name, visitor)
            await self.sessions.restore(name, seen)
            number = self.sessions.join(client, name, seen, visitor)
        except JournalError as error:
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from None
        try:
            yield number
        finally:
            self.sessions.leave(number)

    async def body(self, request: Request, most: int | None = None) -> bytes:
        """Return the body of a request.

        Raises:
            JoinError: 413, it is too long; 400, it is empty.
        """
        limit, body = most or self.settings.max_document, b""
        async for part in request.stream():
            body += part
            if len(body) > limit:
                hint = "" if most else f" {limit_hint('max_document')}"
                raise JoinError(
                    HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"body: wanted at most {limit} bytes{hint}"
                )
        if not body.strip():
            raise JoinError(HTTPStatus.BAD_REQUEST, "body: wanted BML or a text to speak, got nothing")
        return body


def address_of(connection: HTTPConnection) -> str:
    """Return the IP address of a client, or ""."""
    return connection.client.host if connection.client else ""
