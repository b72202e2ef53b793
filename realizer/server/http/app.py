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
from typing import Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from realizer.core.settings import Settings
from realizer.outputs.registry import OUTPUTS
from realizer.server.http.http_site import FRAMES
from realizer.server.http.hub import Hub, address_of
from realizer.server.http.openapi import FINDING, description
from realizer.server.http.page_tools import MAX_TEXT
from realizer.server.http.requests import SOCKETS, session_of
from realizer.server.http.socket_client import SocketClient
from realizer.server.runtime.session_registry import JoinError, Visitor
from realizer.sources import document_of

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
    # Before the site, which answers GET requests for any path.
    routes[-1:-1] = [
        Route(path, _guarded(hub, partial(_refuse_get, method)), methods=["GET"])
        for path, method, _ in handlers
        if method != "GET"
    ]
    sockets = [WebSocketRoute(path, partial(_socket, hub, path)) for path in SOCKETS]
    return Starlette(routes=[*sockets, *routes], lifespan=hub.lifespan)


def _guarded(hub: Hub, handler: Callable[[Hub, Request], Any]) -> Callable[[Request], Any]:
    """Return an endpoint whose refusals are answers, and whose answers pages of allowed origins may read."""

    async def endpoint(request: Request) -> Response:
        await hub.ready()
        try:
            answer: Response = await handler(hub, request)
        except JoinError as error:
            refused = hub.requests.refuse(error, address_of(request))
            answer = JSONResponse({"error": str(error)}, refused.status, dict(refused.headers))
        origin = hub.access.origin_of_reader(f"/{request.path_params.get('path', '')}", dict(request.headers))
        if origin is not None:
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
    client = SocketClient(socket, target, address, hub.settings)
    try:
        await hub.connections.serve(client)
        await client.close(1000, "")
    finally:
        await client.finish()


async def _refuse_get(method: str, hub: Hub, request: Request) -> Response:
    words = f"wanted {method} {request.url.path}, got {request.method}"
    return JSONResponse({"error": words}, HTTPStatus.METHOD_NOT_ALLOWED, {"Allow": method})


async def _site(hub: Hub, request: Request) -> Response:
    hub.access.check_host(dict(request.headers))
    target = f"/{request.path_params['path']}?{request.url.query}"
    found = await hub.requests.answer(target, dict(request.headers))
    return Response(found.body, found.status, dict(found.headers), found.media_type)


async def _openapi(hub: Hub, request: Request) -> Response:
    return JSONResponse(description(request.scope.get("root_path", "")))


async def _realize(hub: Hub, request: Request) -> Response:
    visitor, query = hub.admit(request), dict(request.query_params)
    path = await hub.renderings.render(await hub.body(request), query, visitor.address)
    remove = BackgroundTask(shutil.rmtree, path.parent, ignore_errors=True)
    return FileResponse(path, media_type=OUTPUTS[path.suffix].media_type, background=remove)


async def _check(hub: Hub, request: Request) -> Response:
    from realizer.checking.source import check

    hub.admit(request)
    body = await hub.body(request, MAX_TEXT)
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
    document = document_of(await hub.body(request)).bml
    text = document.decode("utf-8", "replace") if isinstance(document, bytes) else document
    async with hub.joined(_Listener(), name, visitor) as number:
        hub.sessions.receive(number, text)
        await hub.sessions.wait_for_room(number)
    return JSONResponse({"session": name}, HTTPStatus.ACCEPTED)


async def _feedback(hub: Hub, request: Request) -> Response:
    """Stream the feedback of a session as server-sent events, also what came after `Last-Event-ID`."""
    grant, name = hub.grant(request), request.path_params["session"]
    visitor = Visitor(address_of(request), grant.sessions)
    seen = request.query_params.get("seen") or request.headers.get("last-event-id")
    _, number = session_of("/" if seen is None else f"/?seen={seen}")
    joined = hub.joined(listener := _Listener(), name, visitor, number)
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
    peers = hub.open_peers()
    from realizer.server.http.webrtc import Peer, offer_of

    grant, name = hub.grant(request), request.path_params["session"]
    visitor = Visitor(address_of(request), grant.sessions)
    peers.check_room()
    offer, is_json = offer_of(await hub.body(request, MAX_TEXT))
    async with contextlib.AsyncExitStack() as entered:
        entered.enter_context(hub.connections.place(visitor.address))
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
