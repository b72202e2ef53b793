"""One WebSocket connection: admission, session, messages."""

from __future__ import annotations

import asyncio
import contextlib
import http
import logging

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request

from realizer.core.settings import Settings
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.http import access
from realizer.server.http.access import Guard, Pace
from realizer.server.http.jwt_tokens import Pass
from realizer.server.journal import JournalError
from realizer.server.runtime.session_host import Shell
from realizer.server.runtime.session_registry import HubError
from realizer.server.transports.websocket.request import address_of, headers_of, session_of, visitor_of
from realizer.server.transports.websocket.writer import WebSocketClient

log = logging.getLogger(__name__)


class Visits:
    """Lets clients into sessions as `guard` says, and reads them as fast as `settings` say."""

    def __init__(self, shell: Shell, settings: Settings, guard: Guard) -> None:
        self._shell = shell
        self._settings = settings
        self._guard = guard

    async def begin(self, socket: ServerConnection, request: Request) -> None:
        """One visit, to its end; who may not come in is told why."""
        client = WebSocketClient(socket)
        greeting = None
        try:
            allowed = self._guard.request(request.path, headers_of(request), later=True)
            if allowed is None:
                greeting, allowed = await self._greeting(socket)
            visitor = visitor_of(socket, allowed)
            name, seen = session_of(request)
            self._shell.check(name, visitor)  # who greets is known only now
            await self._shell.restore(name, seen)
            number = self._shell.join(client, name, seen, visitor)
        except HubError as error:
            await self._turn_away(socket, client, error)
            return
        except JournalError as error:
            await client.close(1013, str(error))
            return
        told = {"connection": number, "session": name, "address": address_of(socket)}
        log.info("joined", extra=told)
        try:
            if greeting is not None:
                self._shell.receive(number, greeting)
            async with asyncio.timeout(allowed.left):
                await self._read(socket, number, client)
        except ConnectionClosed:
            pass
        except TimeoutError:
            await client.close(1008, "token: it has expired")
        finally:
            self._shell.leave(number)
            log.info("left", extra={**told, "code": socket.close_code})

    async def _read(self, socket: ServerConnection, number: int, client: WebSocketClient) -> None:
        """Hand messages on, no faster than a client may send them: the rest waits in its own buffers."""
        loop = asyncio.get_running_loop()
        pace = Pace(self._settings.max_rate)
        async for message in socket:
            if not self._shell.receive(number, message):
                return
            # 0 too: messages that are there already must not hold up everybody else.
            pause = pace.wait(loop.time())
            if pace.news is not None:
                client.send(ErrorMessage(code="rate", message=pace.news).text())
            await asyncio.sleep(pause)

    async def _greeting(self, socket: ServerConnection) -> tuple[str | bytes, Pass]:
        """The first message of a client that has not brought a token yet, and what its token lets it do.

        Raises:
            HubError: 401, it has said nothing, or something else.
        """
        message: str | bytes = ""
        with contextlib.suppress(ConnectionClosed, TimeoutError):
            async with asyncio.timeout(access.PATIENCE):
                message = await socket.recv()
        return message, self._guard.greets(message)

    async def _turn_away(self, socket: ServerConnection, client: WebSocketClient, error: HubError) -> None:
        """Say why one who is here already may not stay."""
        self._shell.metrics.counts["refused"] += 1
        log.info("refused: %s", error, extra={"address": address_of(socket), "status": error.status})
        unknown = error.status in (http.HTTPStatus.UNAUTHORIZED, http.HTTPStatus.FORBIDDEN)
        if unknown:
            where = "hello.token" if error.status == http.HTTPStatus.UNAUTHORIZED else "hello.session"
            told = ErrorMessage(code="token", message=str(error), where=where)
            with contextlib.suppress(ConnectionClosed):
                await socket.send(told.text())
        await client.close(1008 if unknown else 1013, str(error))
