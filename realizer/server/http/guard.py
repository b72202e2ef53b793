"""What holds for all requests: hosts, refusals in words, and who may read an answer."""

import logging
import re
from http import HTTPStatus

from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, HTTPConnection, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from realizer.server.http.http_site import FRAMES
from realizer.server.http.hub import ENDING, Hub, address_of
from realizer.server.runtime.session_registry import JoinError

log = logging.getLogger(__name__)

RETRY = "5"  # s; when one that was refused for want of room may try again
# Paths whose errors are JSON.
API = re.compile("/(realize|check|openapi[.]json|sessions(/.*)?)$")


class Guard:
    """Middleware that checks the host of a request, answers refusals, and says who may read an answer."""

    def __init__(self, app: ASGIApp, hub: Hub) -> None:
        self._app = app
        self._hub = hub

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        hub = self._hub
        await hub.ready()
        connection, path = HTTPConnection(scope), path_of(scope)
        headers = dict(connection.headers)
        has_begun = False

        async def send_on(message: Message) -> None:
            nonlocal has_begun
            has_begun = True
            if message["type"].endswith("http.response.start"):
                answer = MutableHeaders(scope=message)
                origin = hub.access.origin_of_reader(path, headers)
                if origin is not None:
                    answer["Access-Control-Allow-Origin"] = origin
                answer["Vary"] = "Origin"
                answer["X-Content-Type-Options"] = "nosniff"
                answer.setdefault("Content-Security-Policy", FRAMES)
                if hub.worker is not None:  # the next request may be for a session of another worker
                    answer["Connection"] = "close"
                if (status := message["status"]) >= 400:
                    hub.sessions.metrics.counts["http_errors" if status < 500 else "http_failures"] += 1
            await send(message)

        try:
            hub.access.check_host(headers)
            if hub.sessions.is_ending and scope["type"] == "http" and API.match(path):
                raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, ENDING)
            await self._app(scope, receive, send_on)
        except ClientDisconnect:
            pass
        except JoinError as error:
            await self._refusal(error, connection, path)(scope, receive, send_on)
        except Exception:
            if has_begun:
                raise
            log.exception("there is no answer to %s %s", scope.get("method", "a WebSocket at"), path)
            fault = JoinError(HTTPStatus.INTERNAL_SERVER_ERROR, "an error of the service: its log says which")
            await self._refusal(fault, connection, path)(scope, receive, send_on)

    def _refusal(self, error: JoinError, connection: HTTPConnection, path: str) -> Response:
        self._hub.sessions.metrics.counts["refused"] += 1
        self._hub.access.log_refusal(error, address_of(connection))
        headers = {"WWW-Authenticate": "Bearer"} if error.status == HTTPStatus.UNAUTHORIZED else {}
        if error.retry:
            headers["Retry-After"] = RETRY
        if API.match(path) and connection.scope["type"] == "http":
            return JSONResponse({"error": str(error)}, error.status, headers)
        return PlainTextResponse(f"{error}\n", error.status, headers)


def path_of(scope: Scope) -> str:
    """Return the path of a request inside the application, which may be mounted in another one."""
    path: str = scope["path"]
    return path.removeprefix(scope.get("root_path", ""))


async def refuse_method(request: Request, error: Exception) -> Response:
    """Return the answer to a request by a wrong method."""
    assert isinstance(error, HTTPException)
    assert error.headers is not None
    allowed = error.headers["Allow"]
    wanted = " or ".join(sorted(name.strip() for name in allowed.split(",")))
    words = f"wanted {wanted} {request.url.path}, got {request.method}"
    if API.match(path_of(request.scope)):
        return JSONResponse({"error": words}, HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": allowed})
    return PlainTextResponse(f"{words}\n", HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": allowed})
