"""The hub of an application: its sessions, who may use them, and what requests share."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Coroutine
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, TypeVar

from starlette.requests import HTTPConnection, Request

from realizer.core.settings import Settings, SettingsError, limit_hint
from realizer.server.http.access import ANY_GRANT, AccessControl, Grant
from realizer.server.http.connections import WebSocketConnections
from realizer.server.http.http_site import HttpSite
from realizer.server.http.renderings import Renderings
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.server.transports.transport import Outbound

if TYPE_CHECKING:
    from realizer.server.http.webrtc import Peers

T = TypeVar("T")

PATIENCE = 30.0  # s; for the body of a request
ENDING = "the service is ending: try again later"
GONE = 499  # status for the log: nobody gets an answer


class Hub:
    """The sessions of an application, which start with its first request or with its lifespan.

    Args:
        worker: number of this process among `settings.workers`; None if it is the only one.
    """

    def __init__(self, settings: Settings, worker: int | None = None) -> None:
        if settings.workers > 1 and worker is None:
            raise SettingsError("setting workers: an ASGI application is one process: wanted 1")
        self.settings = settings
        self.worker = worker
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
        self.sessions = SessionHost(self.settings, self.worker)
        await self.sessions.start()
        self.connections = WebSocketConnections(self.sessions, self.settings, self.access)
        self.site = HttpSite(self.settings)
        self.renderings = Renderings(self.settings)
        self.checking = asyncio.Lock()
        self.listeners: set[Outbound] = set()
        self.peers: Peers | None = None
        self._ending = asyncio.Event()

    @contextlib.asynccontextmanager
    async def lifespan(self, _: object) -> AsyncIterator[None]:
        """Start the sessions; at the end wait at most `settings.drain` seconds for what plays."""
        await self.ready()
        try:
            yield
        finally:
            self.sessions.stop_accepting()
            await self.sessions.drain()
            await self.disconnect()
            await self.sessions.close()
            self._starting = None

    async def disconnect(self) -> None:
        """Disconnect all clients, and cancel what their requests have started."""
        self._ending.set()
        for listener in self.listeners:
            listener.disconnect(1001, "")
        await self.connections.close(1001, "the service ends")
        if self.peers is not None:
            await self.peers.close()

    def grant(self, connection: HTTPConnection) -> Grant:
        """Return what the token of a request allows.

        Raises:
            JoinError: 401 or 403, the client may not make it.
        """
        return self.access.request(f"?{connection.url.query}", dict(connection.headers)) or ANY_GRANT

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
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words, retry=False) from None
        self.peers = self.peers or Peers(self.sessions)
        return self.peers

    def admit(self, connection: HTTPConnection) -> Visitor:
        """Return who makes a request; raises as `grant`."""
        return Visitor(address_of(connection), self.grant(connection).sessions)

    def check_worker(self, request: Request) -> None:
        """Raise JoinError (404) if a request is for another worker."""
        worker = request.query_params.get("worker")
        if worker not in (None, str(self.worker or 0)):
            words = f"worker: wanted a number of 0..{self.settings.workers - 1}, got {worker[:80]!r}"
            raise JoinError(HTTPStatus.NOT_FOUND, words)

    @contextlib.asynccontextmanager
    async def joined(
        self, client: Outbound, name: str, visitor: Visitor, seen: int | None = None
    ) -> AsyncIterator[int]:
        """Join a client to a session until the block ends; the value is the number of the connection.

        Raises:
            JoinError: the client may not join it.
        """
        with self.connections.place(visitor.address):
            try:
                self.sessions.check(name, visitor)
                await self.sessions.restore(name, seen)
                number = self.sessions.join(client, name, seen, visitor)
            except JournalError as error:
                raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from None
            self.listeners.add(client)
            try:
                yield number
            finally:
                self.listeners.discard(client)
                self.sessions.leave(number)

    async def body(self, request: Request, most: int | None = None) -> bytes:
        """Return the body of a request.

        Raises:
            JoinError: 413, it is too long; 400, it is empty; 408, it takes too long to come.
        """
        limit, body = most or self.settings.max_document, bytearray()
        try:
            async with asyncio.timeout(PATIENCE):
                async for part in request.stream():
                    body += part
                    if len(body) > limit:
                        words = f"body: wanted at most {limit} bytes"
                        words += "" if most else f" {limit_hint('max_document')}"
                        raise JoinError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, words)
        except TimeoutError:
            words = f"body: wanted all of it within {PATIENCE:g} s"
            raise JoinError(HTTPStatus.REQUEST_TIMEOUT, words) from None
        if not body.strip():
            raise JoinError(HTTPStatus.BAD_REQUEST, "body: wanted BML or a text to speak, got nothing")
        return bytes(body)

    async def attend(self, request: Request, work: Coroutine[Any, Any, T]) -> T:
        """Return the result of work for a request whose body has come; cancel it when nobody waits for it.

        Raises:
            JoinError: the client has gone, or the service ends (503).
        """
        working = asyncio.create_task(work)
        leaving, ending = asyncio.create_task(_disconnect(request)), asyncio.create_task(self._ending.wait())
        try:
            await asyncio.wait({working, leaving, ending}, return_when=asyncio.FIRST_COMPLETED)
            if working.done():
                return working.result()
            if leaving.done():
                raise JoinError(GONE, "the client has gone")
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, ENDING)
        finally:
            for task in (working, leaving, ending):
                task.cancel()
            await asyncio.gather(working, leaving, ending, return_exceptions=True)


async def _disconnect(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def address_of(connection: HTTPConnection) -> str:
    """Return the IP address of a client, or ""."""
    return connection.client.host if connection.client else ""
