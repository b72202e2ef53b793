"""The application: pages and tools as `realizer serve` has them, sessions by WebSocket and by HTTP, files."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
import shutil
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from functools import partial
from http import HTTPStatus
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.types import Receive, Scope, Send
from starlette.websockets import WebSocket

from bml_schema import BMLError
from bml_schema.reading.encodings import decode
from realizer.core.settings import Settings
from realizer.outputs.registry import OUTPUTS
from realizer.server.http.connections import SOCKETS, session_of
from realizer.server.http.guard import Guard, path_of, refuse_method
from realizer.server.http.http_site import JSON
from realizer.server.http.hub import Hub, address_of
from realizer.server.http.metrics import MEDIA_TYPE
from realizer.server.http.openapi import FINDING, description
from realizer.server.http.page_tools import MAX_TEXT
from realizer.server.http.socket_client import SocketClient
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.sources import document_of

if TYPE_CHECKING:
    from realizer.checking.finding import Finding

log = logging.getLogger(__name__)

KEEP_ALIVE = 15.0  # s; proxies close connections in which nothing comes
MOST_UNREAD = 10_000  # messages; a client that reads no more of its feedback is disconnected
SEQ = re.compile(r'\bseq="(\d+)"')


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
    return application(Hub(settings or Settings.read()))


def application(hub: Hub) -> Starlette:
    """Return the application of a hub."""
    handlers: tuple[tuple[str, str, Callable[[Hub, Request], Any]], ...] = (
        ("/realize", "POST", _realize),
        ("/check", "POST", _check),
        ("/sessions/{session}/bml", "POST", _send_bml),
        ("/sessions/{session}/feedback", "GET", _feedback),
        ("/sessions/{session}/webrtc", "POST", _connect_peer),
        ("/sessions/{session}/webrtc/{peer:int}", "DELETE", _disconnect_peer),
        ("/sessions/{session}", "DELETE", _end),
        ("/openapi.json", "GET", _openapi),
        ("/healthz", "GET", _health),
        ("/metrics", "GET", _metrics),
    )
    routes = [Route(path, partial(handler, hub), methods=[method]) for path, method, handler in handlers]
    app = Starlette(
        routes=[WebSocketRoute("/{path:path}", partial(_socket, hub)), *routes],
        middleware=[Middleware(Guard, hub)],
        exception_handlers={405: refuse_method},
        lifespan=hub.lifespan,
    )
    # A route for any path would also answer requests by a wrong method for the paths above.
    app.router.default = Route("/", partial(_site, hub), methods=["GET"]).handle
    return app


async def _socket(hub: Hub, socket: WebSocket) -> None:
    path, address = path_of(socket.scope), address_of(socket)
    if path not in SOCKETS:
        words = f"wanted a WebSocket at {', '.join(SOCKETS)}, got a WebSocket at {path[:80]}\n"
        await socket.send_denial_response(PlainTextResponse(words, HTTPStatus.NOT_FOUND))
        return
    target = f"{path}?{socket.url.query}"
    hub.connections.admit(target, dict(socket.headers), address)
    await socket.accept()
    client = SocketClient(socket, target, address, hub.settings)
    try:
        await hub.connections.serve(client)
        await client.close(1000, "")
    except Exception:
        log.exception("the WebSocket at %s failed", path)
        await client.close(1011, "internal error")
    finally:
        await client.finish()


async def _site(hub: Hub, request: Request) -> Response:
    path = path_of(request.scope)
    if path in SOCKETS:
        words = f"wanted a WebSocket at {', '.join(SOCKETS)}, got plain HTTP at {path}\n"
        return PlainTextResponse(words, HTTPStatus.UPGRADE_REQUIRED, {"Upgrade": "websocket"})
    if not hub.site.is_public(path):
        hub.grant(request)
    known = request.headers.get("if-none-match", "")
    return await asyncio.to_thread(hub.site.answer, f"{quote(path)}?{request.url.query}", known)


async def _health(hub: Hub, request: Request) -> Response:
    hub.check_worker(request)
    return Response(json.dumps({"status": "ok", **hub.sessions.health()}), media_type=JSON)


async def _metrics(hub: Hub, request: Request) -> Response:
    hub.check_worker(request)
    if hub.grant(request).sessions is not None:
        raise JoinError(HTTPStatus.FORBIDDEN, "metrics: wanted a token for all sessions")
    return Response(hub.sessions.metrics_text(), media_type=MEDIA_TYPE)


async def _openapi(hub: Hub, request: Request) -> Response:
    return JSONResponse(description(request.scope.get("root_path", "")))


@contextlib.contextmanager
def _faults_of_texts() -> Iterator[None]:
    """Refuse a text that cannot be spoken because XML cannot hold it."""
    try:
        yield
    except ValueError as error:
        raise JoinError(HTTPStatus.BAD_REQUEST, f"body: {error}") from None


async def _realize(hub: Hub, request: Request) -> Response:
    visitor, query = hub.admit(request), dict(request.query_params)
    language, plain = query.get("language", hub.settings.language), query.get("plain") == "true"
    with _faults_of_texts():
        document = document_of(await hub.body(request), language=language, plain=plain).bml
    path = await hub.attend(request, hub.renderings.render(document, query, visitor.address))
    entered = contextlib.AsyncExitStack()
    entered.callback(shutil.rmtree, path.parent, ignore_errors=True)
    return _Held(FileResponse(path, media_type=OUTPUTS[path.suffix].media_type), entered)


async def _check(hub: Hub, request: Request) -> Response:
    hub.admit(request)
    with _faults_of_texts():
        found = await hub.attend(request, _findings(hub, await hub.body(request, MAX_TEXT)))
    return JSONResponse([{name: getattr(finding, name) for name in FINDING} for finding in found])


async def _findings(hub: Hub, body: bytes) -> Iterable[Finding]:
    from realizer.checking.source import check

    # One at a time: sessions come first.
    async with hub.checking:
        return await asyncio.to_thread(
            check, body, strict_bml=hub.settings.strict_bml, media=hub.settings.media
        )


async def _send_bml(hub: Hub, request: Request) -> Response:
    """Submit the documents or the text in the body to a session, which is opened if it is not there."""
    visitor, name = hub.admit(request), request.path_params["session"]
    language = hub.settings.language
    with _faults_of_texts():
        document = document_of(await hub.body(request), language=language).bml
    text = document if isinstance(document, str) else _text(document)
    async with hub.joined(_Listener(), name, visitor) as number:
        hub.sessions.receive(number, text)
        await hub.attend(request, hub.sessions.wait_for_room(number))
    return JSONResponse({"session": name}, HTTPStatus.ACCEPTED)


def _text(document: bytes) -> str:
    try:
        return decode(document)[0]
    except BMLError:  # the session says what is wrong
        return document.decode("utf-8", "replace")


async def _feedback(hub: Hub, request: Request) -> Response:
    """Stream the feedback of a session as server-sent events, also what came after `Last-Event-ID`."""
    grant, name = hub.grant(request), request.path_params["session"]
    visitor = Visitor(address_of(request), grant.sessions)
    seen = request.query_params.get("seen") or request.headers.get("last-event-id")
    _, number = session_of("/" if seen is None else f"/?seen={seen}")
    entered = contextlib.AsyncExitStack()
    await entered.enter_async_context(hub.joined(listener := _Listener(), name, visitor, number))

    async def events() -> AsyncIterator[str]:
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

    headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
    return _Held(StreamingResponse(events(), media_type="text/event-stream", headers=headers), entered)


async def _end(hub: Hub, request: Request) -> Response:
    visitor, name = hub.admit(request), request.path_params["session"]
    hub.sessions.check(name, visitor)
    if not hub.sessions.end(name):
        raise JoinError(HTTPStatus.NOT_FOUND, f"session: wanted one that is open, got {name!r}")
    return Response(status_code=HTTPStatus.NO_CONTENT)


async def _connect_peer(hub: Hub, request: Request) -> Response:
    """Answer the SDP offer in the body: a peer gets the picture and the sound of a session by WebRTC."""
    peers = hub.open_peers()
    from realizer.server.http.webrtc import Peer, offer_of

    grant, name = hub.grant(request), request.path_params["session"]
    visitor = Visitor(address_of(request), grant.sessions)
    peers.check_room()
    offer, is_json = offer_of(await hub.body(request, MAX_TEXT))
    async with contextlib.AsyncExitStack() as entered:
        peer = Peer(name, grant.seconds_left)
        peer.number = await entered.enter_async_context(hub.joined(peer, name, visitor))
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


class _Held(Response):
    """A response, and what ends when all of it has been sent, or its client has gone."""

    def __init__(self, response: Response, entered: contextlib.AsyncExitStack) -> None:
        self._response = response
        self._entered = entered

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async with self._entered:
            await self._response(scope, receive, send)


class _Listener:
    """An `Outbound` that keeps the texts of a session for somebody who reads them."""

    unsent_bytes = 0

    def __init__(self) -> None:
        self.messages: asyncio.Queue[str | None] = asyncio.Queue()

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str):
            self.messages.put_nowait(data if self.messages.qsize() < MOST_UNREAD else None)

    def disconnect(self, code: int, reason: str) -> None:
        self.messages.put_nowait(None)
