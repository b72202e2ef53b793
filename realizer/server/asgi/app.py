"""The application: pages and tools as `realizer serve` has them, sessions by WebSocket and by HTTP, files."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import shutil
from collections.abc import AsyncIterator, Callable
from functools import partial
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from realizer.core.settings import Settings, SettingsError, limit_hint
from realizer.outputs.registry import OUTPUTS
from realizer.server.asgi.client import AsgiClient
from realizer.server.asgi.openapi import FINDING, description
from realizer.server.asgi.renderings import Renderings
from realizer.server.http.access import ANY_GRANT, AccessControl, Grant
from realizer.server.http.http_site import FRAMES
from realizer.server.http.page_tools import MAX_TEXT
from realizer.server.http.requests import SOCKETS, HttpRequests, session_of
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.server.transports.transport import Outbound
from realizer.server.transports.websocket.connection import WebSocketConnections
from realizer.sources import document_of

if TYPE_CHECKING:
    from realizer.server.asgi.webrtc import Peers

KEEP_ALIVE = 15.0  # s; proxies close connections in which nothing comes
MOST_UNREAD = 10_000  # messages; a client that reads no more of its feedback is disconnected
SEQ = re.compile(r'\bseq="(\d+)"')


class Hub:
    """The sessions of an application, which start with its first request or with its lifespan."""

    def __init__(self, settings: Settings) -> None:
        if settings.workers > 1:
            raise SettingsError("setting workers: an ASGI application is one process: wanted 1")
        self.settings = settings
        self.access = AccessControl(settings)
        self._starting: asyncio.Task[None] | None = None
        self.sessions: SessionHost

    async def ready(self) -> Hub:
        """Return the hub when its sessions can be joined.

        Raises:
            RealizerError, OSError: something that the settings name is missing.
        """
        if self._starting is None:
            self._starting = asyncio.create_task(self._start())
        await asyncio.shield(self._starting)
        return self

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

    def admit(self, connection: HTTPConnection) -> Visitor:
        """Return who makes a request; raises as `grant`."""
        return Visitor(address_of(connection), self.grant(connection).sessions)


def create_app(settings: Settings | None = None) -> Starlette:
    """Return an application with sessions of its own.

    Inside another application, which runs no lifespan of those it mounts, pass its lifespan on:
    `FastAPI(lifespan=app.router.lifespan_context)`. Otherwise sessions start with the first request, and end
    with the process.

    Args:
        settings: as for `realizer serve`; default: REALIZER_* variables.

    Raises:
        SettingsError: they are wrong, or ask for several workers.
    """
    hub = Hub(settings or Settings.read())
    handlers: tuple[tuple[str, str, Callable[[Hub, Request], Any]], ...] = (
        ("/realize", "POST", _realize),
        ("/check", "POST", _check),
        ("/sessions/{session}/bml", "POST", _send_bml),
        ("/sessions/{session}/feedback", "GET", _feedback),
        ("/sessions/{session}/webrtc", "POST", _connect_peer),
        ("/sessions/{session}/webrtc/{peer:int}", "DELETE", _disconnect_peer),
        ("/sessions/{session}", "DELETE", _end),
        ("/openapi.json", "GET", _openapi),
        ("/{path:path}", "GET", _site),
    )
    routes = [Route(path, _guarded(hub, handler), methods=[method]) for path, method, handler in handlers]
    sockets = [WebSocketRoute(path, partial(_socket, hub, path)) for path in SOCKETS]
    return Starlette(routes=[*sockets, *routes], lifespan=hub.lifespan)


def address_of(connection: HTTPConnection) -> str:
    """Return the IP address of a client, or ""."""
    return connection.client.host if connection.client else ""


def _guarded(hub: Hub, handler: Callable[[Hub, Request], Any]) -> Callable[[Request], Any]:
    """Return an endpoint whose refusals are answers, and whose answers pages of allowed origins may read."""

    async def endpoint(request: Request) -> Response:
        await hub.ready()
        try:
            answer: Response = await handler(hub, request)
        except JoinError as error:
            refused = hub.requests.refuse(error, address_of(request))
            answer = JSONResponse({"error": str(error)}, refused.status, dict(refused.headers))
        origin = request.headers.get("origin")
        if origin is not None and hub.access.allows_origin(dict(request.headers)):
            answer.headers["Access-Control-Allow-Origin"] = origin
        answer.headers["Vary"] = "Origin"
        answer.headers["X-Content-Type-Options"] = "nosniff"
        answer.headers.setdefault("Content-Security-Policy", FRAMES)
        return answer

    return endpoint


async def _socket(hub: Hub, path: str, socket: WebSocket) -> None:
    await hub.ready()
    target, address = f"{path}?{socket.url.query}", address_of(socket)
    try:
        hub.access.check_host(dict(socket.headers))
        hub.connections.admit(target, dict(socket.headers), address)
    except JoinError as error:
        refused = hub.requests.refuse(error, address)
        await socket.send_denial_response(
            Response(refused.body, refused.status, dict(refused.headers), refused.media_type)
        )
        return
    await socket.accept()
    client = AsgiClient(socket, target, address, hub.settings)
    try:
        await hub.connections.serve(client)
        await client.close(1000, "")
    finally:
        await client.finish()


async def _site(hub: Hub, request: Request) -> Response:
    hub.access.check_host(dict(request.headers))
    target = f"/{request.path_params['path']}?{request.url.query}"
    found = await hub.requests.answer(target, dict(request.headers))
    return Response(found.body, found.status, dict(found.headers), found.media_type)


async def _openapi(hub: Hub, request: Request) -> Response:
    return JSONResponse(description(request.scope.get("root_path", "")))


async def _realize(hub: Hub, request: Request) -> Response:
    visitor, query = hub.admit(request), dict(request.query_params)
    path = await hub.renderings.render(await _body(hub, request), query, visitor.address)
    remove = BackgroundTask(shutil.rmtree, path.parent, ignore_errors=True)
    return FileResponse(path, media_type=OUTPUTS[path.suffix].media_type, background=remove)


async def _check(hub: Hub, request: Request) -> Response:
    from realizer.checking.source import check

    hub.admit(request)
    body = await _body(hub, request, MAX_TEXT)
    loop = asyncio.get_running_loop()
    # One at a time: sessions come first.
    async with hub.checking:
        found = await loop.run_in_executor(
            None, partial(check, body, strict_bml=hub.settings.strict_bml, media=hub.settings.media)
        )
    return JSONResponse([{name: getattr(finding, name) for name in FINDING} for finding in found])


async def _send_bml(hub: Hub, request: Request) -> Response:
    """Submit the documents or the text in the body to a session, which is opened if it is not there."""
    visitor, name = hub.admit(request), request.path_params["session"]
    document = document_of(await _body(hub, request)).bml
    text = document.decode("utf-8", "replace") if isinstance(document, bytes) else document
    async with _joined(hub, _Listener(), name, None, visitor) as number:
        hub.sessions.receive(number, text)
        await hub.sessions.wait_for_room(number)
    return JSONResponse({"session": name}, HTTPStatus.ACCEPTED)


async def _feedback(hub: Hub, request: Request) -> Response:
    """Stream the feedback of a session as server-sent events, also what came after `Last-Event-ID`."""
    grant, name = hub.grant(request), request.path_params["session"]
    visitor = Visitor(address_of(request), grant.sessions)
    seen = request.query_params.get("seen") or request.headers.get("last-event-id")
    _, number = session_of("/" if seen is None else f"/?seen={seen}")
    joined = _joined(hub, listener := _Listener(), name, number, visitor)
    await joined.__aenter__()  # a refusal is the answer, not an event

    async def events() -> AsyncIterator[str]:
        try:
            while (left := grant.seconds_left) is None or left:  # as long as the token is valid
                try:
                    async with asyncio.timeout(KEEP_ALIVE if left is None else min(left, KEEP_ALIVE)):
                        message = await listener.messages.get()
                except TimeoutError:
                    yield ": nothing new\n\n"
                    continue
                if message is None:
                    return
                yield event_of(message)
        finally:
            await joined.__aexit__(None, None, None)

    headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
    return StreamingResponse(events(), media_type="text/event-stream", headers=headers)


async def _end(hub: Hub, request: Request) -> Response:
    visitor, name = hub.admit(request), request.path_params["session"]
    hub.sessions.check(name, visitor)
    if not hub.sessions.end(name):
        raise JoinError(HTTPStatus.NOT_FOUND, f"session: wanted one that is open, got {name!r}")
    return Response(status_code=HTTPStatus.NO_CONTENT)


async def _connect_peer(hub: Hub, request: Request) -> Response:
    """Answer the SDP offer in the body: a peer gets the picture and the sound of a session by WebRTC."""
    try:
        from realizer.server.asgi.webrtc import Peer, Peers, offer_of
    except ImportError as error:
        if error.name is None or error.name.partition(".")[0] not in ("aiortc", "av"):
            raise
        words = "WebRTC: wanted the webrtc extra: pip install 'bml-realizer[webrtc]'"
        raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words) from None
    grant, name = hub.grant(request), request.path_params["session"]
    visitor, peers = Visitor(address_of(request), grant.sessions), hub.peers or Peers(hub.sessions)
    hub.peers = peers
    peers.check_room()
    offer, is_json = offer_of(await _body(hub, request, MAX_TEXT))
    async with contextlib.AsyncExitStack() as entered:
        entered.enter_context(hub.connections.place(visitor.address))
        peer = Peer(name, grant.seconds_left)
        peer.number = await entered.enter_async_context(_joined(hub, peer, name, None, visitor))
        sdp = await peers.answer(offer, dict(request.query_params), peer, entered)
    if is_json:
        return JSONResponse({"type": "answer", "sdp": sdp})
    place = f"{request.url.path}/{peer.number}"
    return Response(sdp, HTTPStatus.CREATED, {"Location": place}, "application/sdp")


async def _disconnect_peer(hub: Hub, request: Request) -> Response:
    visitor, name = hub.admit(request), request.path_params["session"]
    hub.sessions.check(name, visitor)
    number = request.path_params["peer"]
    if hub.peers is None or not hub.peers.end(name, number):
        raise JoinError(HTTPStatus.NOT_FOUND, f"peer: wanted one of this session, got {number}")
    return Response(status_code=HTTPStatus.NO_CONTENT)


def event_of(message: str) -> str:
    """Return a message of a session as a server-sent event: `feedback` with its seq, or the type."""
    is_feedback = message.startswith("<")
    name = "feedback" if is_feedback else json.loads(message)["type"]
    seq = SEQ.search(message) if is_feedback else None
    data = "".join(f"data: {line}\n" for line in message.splitlines())
    return f"event: {name}\n{f'id: {seq[1]}' + chr(10) if seq else ''}{data}\n"


class _Listener:
    """An `Outbound` that keeps the texts of a session for somebody who reads them."""

    def __init__(self) -> None:
        self.messages: asyncio.Queue[str | None] = asyncio.Queue()

    @property
    def unsent_bytes(self) -> int:
        return 0

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str):
            self.messages.put_nowait(data if self.messages.qsize() < MOST_UNREAD else None)

    def disconnect(self, code: int, reason: str) -> None:
        self.messages.put_nowait(None)


@contextlib.asynccontextmanager
async def _joined(
    hub: Hub, client: Outbound, name: str, seen: int | None, visitor: Visitor
) -> AsyncIterator[int]:
    """Join a client to a session until the block ends; the value is the number of the connection.

    Raises:
        JoinError: the client may not join it.
    """
    try:
        hub.sessions.check(name, visitor)
        await hub.sessions.restore(name, seen)
        number = hub.sessions.join(client, name, seen, visitor)
    except JournalError as error:
        raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, str(error)) from None
    try:
        yield number
    finally:
        hub.sessions.leave(number)


async def _body(hub: Hub, request: Request, most: int | None = None) -> bytes:
    """Return the body of a request.

    Raises:
        JoinError: 413, it is too long; 400, it is empty.
    """
    limit, body = most or hub.settings.max_document, b""
    async for part in request.stream():
        body += part
        if len(body) > limit:
            hint = "" if most else f" {limit_hint('max_document')}"
            raise JoinError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"body: wanted at most {limit} bytes{hint}")
    if not body.strip():
        raise JoinError(HTTPStatus.BAD_REQUEST, "body: wanted BML or a text to speak, got nothing")
    return body
