"""The HTTP request of a WebSocket, and HTTP responses."""

import http
from urllib.parse import parse_qsl

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from realizer.server.http.http_site import FRAMES, HttpResponse
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
        JoinError: 400, `seen` is not a number.
    """
    query = query_of(target)
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
