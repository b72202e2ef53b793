"""The routes of sessions: BML in, feedback out, the WebSocket, and their end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
from collections.abc import AsyncIterator
from http import HTTPStatus
from typing import Any

from realizer.asgi.gateway import Gateway, Outlet, target_of
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.http.access import PATIENCE, RateLimiter
from realizer.server.http.jwt_tokens import Grant
from realizer.server.journal import JournalError
from realizer.server.runtime.session_registry import JoinError
from realizer.sources import spoken

KEEP_ALIVE = 15.0  # s between comments of a quiet event stream, so that proxies keep it open
SEQ = re.compile(r'\brealizer:seq="(\d+)"')


class Sessions:
    """The handlers of these routes."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._settings = gateway.settings
        self._spoken = 0

    async def send(self, request: Any, grant: Grant) -> Any:
        """Answer POST /sessions/ID/bml: send BML or a text to a session, which is made if there is none."""
        from starlette.responses import JSONResponse

        text = (await self._gateway.body_of(request)).decode("utf-8-sig")
        if "<" not in text:
            self._spoken += 1
            text = spoken(text, self._spoken)
        async with self._gateway.joined(request, grant, Outlet()) as number:
            self._gateway.sessions.receive(number, text)
            await self._gateway.sessions.wait_for_room(number)
        session = request.path_params["session"]
        return JSONResponse({"session": session}, HTTPStatus.ACCEPTED)

    async def feedback(self, request: Any, grant: Grant) -> Any:
        """Answer GET /sessions/ID/feedback: feedback as server-sent events, whose ids are those of `seen`."""
        from starlette.responses import StreamingResponse

        outlet = Outlet()
        joined = self._gateway.joined(request, grant, outlet)
        await joined.__aenter__()  # before the answer, so that a refusal has a status

        async def events() -> AsyncIterator[str]:
            messages, waiting = outlet.messages(), None
            try:
                while True:
                    waiting = waiting or asyncio.ensure_future(anext(messages, None))
                    done, _ = await asyncio.wait([waiting], timeout=KEEP_ALIVE)
                    if not done:
                        yield ": quiet\n\n"
                        continue
                    data, waiting = waiting.result(), None
                    if data is None:
                        return
                    if isinstance(data, str):
                        yield _event(data)
            finally:
                if waiting is not None:
                    waiting.cancel()
                await joined.__aexit__(None, None, None)

        return StreamingResponse(
            events(), media_type="text/event-stream", headers={"Cache-Control": "no-cache"}
        )

    async def delete(self, request: Any, grant: Grant) -> Any:
        """Answer DELETE /sessions/ID: end a session."""
        from starlette.responses import JSONResponse, Response

        name, sessions = request.path_params["session"], await self._gateway.ready()
        if grant.sessions is not None and name not in grant.sessions:
            raise JoinError(403, f"session: wanted one that the token is for, got {name[:80]!r}")
        if not sessions.end(name):
            return JSONResponse({"error": f"session: there is no {name[:80]!r}"}, HTTPStatus.NOT_FOUND)
        return Response(status_code=HTTPStatus.NO_CONTENT)

    async def websocket(self, socket: Any) -> None:
        """Serve a WebSocket at /ws, as `realizer serve` does."""
        from starlette.websockets import WebSocketDisconnect

        headers, hello, outlet = dict(socket.headers), None, Outlet()
        await socket.accept()
        try:
            self._gateway.access.check_host(headers)
            grant = self._gateway.access.request(target_of(socket), headers, later=True)
            if grant is None:
                hello = await asyncio.wait_for(socket.receive(), PATIENCE)
                grant = self._gateway.access.check_hello(hello.get("text") or "")
            async with self._gateway.joined(socket, grant, outlet) as number:
                writing = asyncio.create_task(self._write(socket, outlet))
                try:
                    async with asyncio.timeout(grant.seconds_left):
                        await self._read(socket, outlet, number, hello)
                finally:
                    writing.cancel()
        except (WebSocketDisconnect, TimeoutError):
            pass
        except (JoinError, JournalError) as error:
            status = getattr(error, "status", HTTPStatus.SERVICE_UNAVAILABLE)
            is_forbidden = status in (HTTPStatus.UNAUTHORIZED, HTTPStatus.FORBIDDEN)
            where = "hello.token" if status == HTTPStatus.UNAUTHORIZED else "hello.session"
            if is_forbidden:
                await socket.send_text(ErrorMessage(code="token", message=str(error), where=where).text())
            await socket.close(1008 if is_forbidden else 1013, str(error)[:120])

    async def _read(self, socket: Any, outlet: Outlet, number: int, first: Any) -> None:
        limiter = RateLimiter(self._settings.max_rate)

        def warn(notice: str) -> None:
            outlet.send(ErrorMessage(code="rate", message=notice).text())

        while True:
            message = first or await socket.receive()
            first = None
            if message["type"] == "websocket.disconnect":
                return
            data = message.get("text") if message.get("bytes") is None else message["bytes"]
            if len(data) > self._settings.max_message or not self._gateway.sessions.receive(number, data):
                return
            await limiter.pause(warn)
            await self._gateway.sessions.wait_for_room(number)

    @staticmethod
    async def _write(socket: Any, outlet: Outlet) -> None:
        with contextlib.suppress(RuntimeError):  # the socket is closed
            async for data in outlet.messages():
                await (socket.send_text(data) if isinstance(data, str) else socket.send_bytes(data))
            code, reason = outlet.end
            await socket.close(code, reason[:120])


def _event(message: str) -> str:
    """Return a message as a server-sent event: feedback with its number, others with their type."""
    seq = SEQ.search(message)
    kind = "feedback" if message.startswith("<") else json.loads(message)["type"]
    lines = message.splitlines()
    return (
        f"event: {kind}\n"
        + (f"id: {seq[1]}\n" if seq else "")
        + "".join(f"data: {x}\n" for x in lines)
        + "\n"
    )
