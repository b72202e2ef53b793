"""HTTP requests: their parts, who may make them, and the answers of the site, the metrics and the health."""

import asyncio
import http
from collections.abc import Mapping
from urllib.parse import parse_qsl

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from realizer.core.settings import Settings
from realizer.core.similar import did_you_mean, similar
from realizer.server.editors import EDITORS
from realizer.server.http.access import AccessControl
from realizer.server.http.http_site import FRAMES, TEXT, HttpResponse, HttpSite
from realizer.server.http.metrics import MEDIA_TYPE
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError


def address_of(socket: ServerConnection) -> str:
    """Return the IP address of a client; "" if the socket has none, or is closed."""
    try:
        remote = socket.remote_address
    except (AttributeError, OSError):  # uvloop asks the socket, which may be closed
        return ""
    return str(remote[0]) if isinstance(remote, tuple) else ""


def headers_of(request: Request) -> dict[str, str]:
    """Return the headers by lower-case names; of several with one name the last."""
    return {name.lower(): value for name, value in request.headers.raw_items()}


def query_of(target: str) -> dict[str, str]:
    """Return the query of a request's target; of several values with one name the last."""
    return dict(parse_qsl(target.partition("?")[2], keep_blank_values=True))


def session_of(target: str) -> tuple[str | None, int | None]:
    """Return the session and the number in `?session=ID&seen=N`.

    Raises:
        JoinError: 400, `seen` is not a number, or a parameter is a misspelt one.
    """
    query = query_of(target)
    for name in sorted(query.keys() - PARAMETERS)[:8]:
        if near := did_you_mean(similar(name, PARAMETERS, most=1, cutoff=0.7)):
            raise JoinError(400, f"the address has an unknown parameter {name[:80]!r}{near}")
    session, seen = query.get("session") or None, query.get("seen")
    if seen is None:
        return session, None
    if not (seen.isascii() and seen.isdigit() and len(seen) < 16):
        raise JoinError(400, f"seen: wanted the number of the last feedback that came, got {seen[:80]!r}")
    return session, int(seen)


def path_of(target: str) -> str:
    """Return the path of a request's target as it was sent, without its query."""
    return target.partition("?")[0]


def response_to(answer: HttpResponse, origin: str | None = None) -> Response:
    """Convert a response for the websockets library; pages of `origin` may read it beside those of ours."""
    headers = Headers(
        {
            "Content-Type": answer.media_type,
            "Content-Length": str(len(answer.body)),
            "X-Content-Type-Options": "nosniff",
            "Content-Security-Policy": FRAMES,
            "Vary": "Origin",
            "Connection": "close",
            **({} if origin is None else {"Access-Control-Allow-Origin": origin}),
            **dict(answer.headers),
        }
    )
    return Response(answer.status, http.HTTPStatus(answer.status).phrase, headers, answer.body)


PARAMETERS = frozenset({"session", "seen", "token"})  # of a WebSocket's address; others are ignored
SOCKETS = ("/ws", "/check", *(f"/{name}" for name in EDITORS))  # paths of WebSockets


class HttpRequests:
    """The answers to GET requests that open no WebSocket."""

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
        self._access.log_refusal(error, address)
        headers = (("WWW-Authenticate", "Bearer"),) if error.status == http.HTTPStatus.UNAUTHORIZED else ()
        return HttpResponse(error.status, TEXT, f"{error}\n".encode(), headers)

    def _wrong_worker(self, target: str) -> str | None:
        worker = query_of(target).get("worker")
        if worker in (None, str(self._worker)):
            return None
        return f"worker: wanted a number of 0..{self._settings.workers - 1}, got {worker[:80]!r}"
