"""What all routes share: the sessions, access, and clients that join."""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from http import HTTPStatus
from typing import Any

from bml_schema import BMLError
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, limit_hint
from realizer.server.http.access import AccessControl
from realizer.server.http.http_site import FRAMES, HttpSite
from realizer.server.http.jwt_tokens import Grant
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor


class Outlet:
    """The way out to one client, an `Outbound`: a queue of what was sent; None ends it."""

    def __init__(self) -> None:
        self.queue: asyncio.Queue[str | bytes | None] = asyncio.Queue()
        self.end = (1000, "")
        self.unsent_bytes = 0

    def send(self, data: str | bytes) -> None:
        self.unsent_bytes += len(data)
        self.queue.put_nowait(data)

    def disconnect(self, code: int, reason: str) -> None:
        self.end = code, reason
        self.queue.put_nowait(None)

    async def messages(self) -> AsyncIterator[str | bytes]:
        """Yield what is sent, until the client is disconnected."""
        while (data := await self.queue.get()) is not None:
            self.unsent_bytes -= len(data)
            yield data


class Gateway:
    """The way of requests to the sessions.

    Attributes:
        settings: of the service.
        access: its access rules; site: its page.
        sessions: the sessions, once `ready` has started them.
        working: held while a document is realized or checked: one at a time, because sessions come first.
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.access = AccessControl(settings)
        self.working = asyncio.Lock()
        self.sessions = SessionHost(settings)
        self.site = HttpSite(self.sessions.health, settings)
        self._starting = asyncio.Lock()
        self._is_open = False
        self._from: Counter[str] = Counter()  # address -> its open connections

    async def ready(self) -> SessionHost:
        """Return the sessions, started."""
        async with self._starting:
            if not self._is_open:
                await self.sessions.start()
                self._is_open = True
        return self.sessions

    async def close(self) -> None:
        """End all sessions."""
        if self._is_open:
            self._is_open = False
            await self.sessions.close()

    def guarded(
        self, handler: Callable[[Any, Grant], Awaitable[Any]], *, public: bool = False
    ) -> Callable[[Any], Awaitable[Any]]:
        """Return a handler for requests of allowed hosts and origins with a valid token.

        Args:
            public: whether what the page consists of needs no token.
        """

        async def handle(request: Any) -> Any:
            from starlette.responses import JSONResponse

            headers, path = dict(request.headers), "/" + request.path_params.get("path", "")
            try:
                self.access.check_host(headers)
                is_open = public and (request.url.path.endswith("/openapi.json") or self.site.is_public(path))
                grant = Grant() if is_open else self.access.request(target_of(request), headers)
                answer = await handler(request, grant or Grant())
            except JoinError as error:
                self.sessions.metrics.counts["refused"] += 1
                challenge = {"WWW-Authenticate": "Bearer"} if error.status == HTTPStatus.UNAUTHORIZED else {}
                answer = JSONResponse({"error": str(error)}, error.status, challenge)
            except JournalError as error:
                answer = JSONResponse({"error": str(error)}, HTTPStatus.SERVICE_UNAVAILABLE)
            except BMLError as error:
                fault = {"error": str(error), "line": error.line, "path": error.path}
                answer = JSONResponse(fault, HTTPStatus.BAD_REQUEST)
            except (TypeError, ValueError) as error:
                answer = JSONResponse({"error": str(error)}, HTTPStatus.BAD_REQUEST)
            except RealizerError as error:
                answer = JSONResponse({"error": str(error)}, HTTPStatus.NOT_IMPLEMENTED)
            if (origin := headers.get("origin")) and self.access.allows_origin(headers):
                answer.headers["Access-Control-Allow-Origin"] = origin
            answer.headers.update({"X-Content-Type-Options": "nosniff", "Vary": "Origin"})
            answer.headers.setdefault("Content-Security-Policy", FRAMES)
            return answer

        return handle

    async def body_of(self, request: Any) -> bytes:
        """Return the body of a request.

        Raises:
            JoinError: 413, it is longer than a document may be; 503, memory is used up.
        """
        self.access.check_memory()
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > self.settings.max_document:
                words = f"wanted at most {self.settings.max_document} bytes {limit_hint('max_document')}"
                raise JoinError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, words)
        return body

    @contextlib.asynccontextmanager
    async def joined(self, request: Any, grant: Grant, outlet: Outlet) -> AsyncIterator[int]:
        """Join the session of a request: that of its path, or ?session=ID; yield the connection's number.

        Raises:
            JoinError: as `SessionHost.check`, or 429 if its address has too many connections.
        """
        address = request.client.host if request.client else ""
        most, query = self.settings.max_connections, request.query_params
        if self._from[address] >= most:
            words = (
                f"{most} connections from {address} are open: wanted fewer {limit_hint('max_connections')}"
            )
            raise JoinError(HTTPStatus.TOO_MANY_REQUESTS, words)
        name = request.path_params.get("session") or query.get("session") or None
        seen = request.headers.get("last-event-id") or query.get("seen")
        if seen is not None and not (seen.isascii() and seen.isdigit() and len(seen) < 16):
            raise JoinError(400, f"seen: wanted the number of the last feedback that came, got {seen[:80]!r}")
        visitor, sessions = Visitor(address, grant.sessions), await self.ready()
        sessions.check(name, visitor)
        await sessions.restore(name, None if seen is None else int(seen))
        number = sessions.join(outlet, name, None if seen is None else int(seen), visitor)
        self._from[address] += 1
        try:
            yield number
        finally:
            sessions.leave(number)
            self._from[address] -= 1


def target_of(request: Any) -> str:
    """Return the path and the query of a request, below the place where the application is mounted."""
    path = request.scope["path"].removeprefix(request.scope.get("root_path", "")) or "/"
    query = request.scope.get("query_string", b"").decode("latin-1")
    return f"{path}?{query}" if query else str(path)
