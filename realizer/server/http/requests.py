"""Requests for the site, the metrics and the health of the service: who may make them, and their answers."""

import asyncio
import http
import logging
from collections.abc import Mapping

from realizer.core.settings import Settings
from realizer.server.http.access import AccessControl
from realizer.server.http.http_site import TEXT, HttpResponse, HttpSite
from realizer.server.http.metrics import MEDIA_TYPE
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.websocket.request import path_of, query_of

log = logging.getLogger(__name__)

SOCKETS = ("/ws", "/check", "/studio")  # paths of WebSockets


class HttpRequests:
    """The answers to GET requests that open no WebSocket.

    Args:
        worker: number of this process among several.
    """

    def __init__(
        self, sessions: SessionHost, settings: Settings, access: AccessControl, worker: int = 0
    ) -> None:
        self._sessions = sessions
        self._settings = settings
        self._access = access
        self._worker = worker
        self._site = HttpSite(sessions.health, settings)

    async def answer(self, target: str, headers: Mapping[str, str], *, upgrade: bool = False) -> HttpResponse:
        """Return the answer to a request.

        Args:
            target: path and query.
            headers: by lower-case names.
            upgrade: whether a WebSocket is wanted, where there is none.

        Raises:
            JoinError: the client may not make it.
        """
        path = path_of(target)
        if path in SOCKETS or upgrade:
            got = "a WebSocket" if upgrade else "plain HTTP"
            words = f"wanted a WebSocket at {', '.join(SOCKETS)}, got {got} at {path}\n"
            return HttpResponse(426 if not upgrade else 404, TEXT, words.encode())
        if path in ("/metrics", "/healthz") and (wrong := self._wrong_worker(target)) is not None:
            return HttpResponse(404, TEXT, f"{wrong}\n".encode())
        if not self._site.is_public(path):
            grant = self._access.request(target, headers)
            if path == "/metrics" and (grant is None or grant.sessions is not None):
                raise JoinError(http.HTTPStatus.FORBIDDEN, "metrics: wanted a token for all sessions")
        if path == "/metrics":
            return HttpResponse(200, MEDIA_TYPE, self._sessions.metrics_text().encode())
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(None, self._site.answer, target, headers.get("if-none-match", ""))

    def refuse(self, error: JoinError, address: str) -> HttpResponse:
        """Log a request that was refused, and return its answer."""
        self._sessions.metrics.counts["refused"] += 1
        log.info("refused: %s", error, extra={"address": address, "status": error.status})
        headers = (("WWW-Authenticate", "Bearer"),) if error.status == http.HTTPStatus.UNAUTHORIZED else ()
        return HttpResponse(error.status, TEXT, f"{error}\n".encode(), headers)

    def _wrong_worker(self, target: str) -> str | None:
        """Return the error if a request names another worker, or None."""
        worker = query_of(target).get("worker")
        if worker in (None, str(self._worker)):
            return None
        return f"worker: wanted a number of 0..{self._settings.workers - 1}, got {worker[:80]!r}"
