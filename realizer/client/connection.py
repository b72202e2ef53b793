"""The connection of a client: its WebSocket, and the requests that are sent over it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Mapping
from copy import copy
from errno import ECONNREFUSED
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from realizer.client.errors import ClientError, ClosedError
from realizer.client.message_router import Router
from realizer.protocol.messages.common import ANSWERS, PROTOCOL


class Connection:
    """A connection to a service, which `open` opens.

    Args:
        url: address of the service's WebSocket.
        token: of the service, if it requires one.

    Attributes:
        router: what has arrived.
        welcome: the first message of the service.
    """

    def __init__(self, url: str, token: str | None = None) -> None:
        self.url = url
        self.router = Router()
        self.welcome: Mapping[str, Any] = {}
        self._token = token
        self._socket: Any = None
        self._received = asyncio.Condition()
        self._end: ClientError | None = None  # why nothing more comes
        self._reader: asyncio.Task[None] | None = None
        self._request_lock = asyncio.Lock()

    async def open(self) -> None:
        """Connect. Errors as of `connect`."""
        self._socket = await _dial(self.url)
        self._reader = asyncio.create_task(self._read())
        token = {} if self._token is None else {"token": self._token}
        try:
            self.welcome = await self.ask("hello", version=PROTOCOL, **token)
        except BaseException:
            await self.close()
            raise

    async def post(self, message: str | bytes) -> None:
        """Send a message.

        Raises:
            ClientError: the connection has ended.
        """
        from websockets.exceptions import ConnectionClosed

        try:
            await self._socket.send(message)
        except ConnectionClosed:
            await self.wait_for(lambda: False)  # raises once the reader knows the reason

    async def control(self, type: str, **fields: Any) -> None:
        """Send a control message. Errors as of `post`."""
        await self.post(json.dumps({"type": type, **fields}))

    async def ask(self, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer. Errors as of `Client.ask`."""
        if type not in ANSWERS:
            raise ValueError(f"wanted one of {', '.join(ANSWERS)}, which are answered; got {type}")
        async with self._request_lock:
            self.router.expect_answer(type)
            await self.control(type, **fields)
            await self.wait_for(lambda: self.router.has_answer)
            return self.router.answer()

    async def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds. It is checked after each message of the service.

        Raises:
            ClientError: the connection ended first, also because a message could not be read.
        """
        async with self._received:
            await self._received.wait_for(lambda: condition() or self._end is not None)
        if not condition():
            self.check()

    def check(self) -> None:
        """Raise ClientError if the connection has ended."""
        if self._end is not None:
            raise copy(self._end)  # for each caller, with a traceback of its own

    async def close(self) -> None:
        """Close the connection."""
        self._end = self._end or ClosedError()
        await self._socket.close()
        if self._reader is not None:
            await self._reader

    async def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            while True:
                message = await self._socket.recv()
                self.router.receive(message)
                async with self._received:
                    self._received.notify_all()
        except ConnectionClosed as closed:
            reason = closed.rcvd.reason if closed.rcvd is not None else ""
            end = ClientError("the connection has ended" + (f": {reason}" if reason else ""))
        except Exception as fault:
            end = ClientError(f"a message of the service cannot be read: {fault!r}")
            await self._socket.close()
        self._end = self._end or end
        async with self._received:
            self._received.notify_all()


def address_of(url: str, **fields: str) -> str:
    """Return the address of a session of the same service; fields: session, seen."""
    parts = urlsplit(url)
    query = {name: value for name, value in parse_qsl(parts.query) if name not in ("session", "seen")}
    return parts._replace(query=urlencode(query | fields)).geturl()


async def _dial(url: str) -> Any:
    """Return an open WebSocket. Errors as of `connect`."""
    from websockets.asyncio.client import connect as dial
    from websockets.exceptions import InvalidStatus, WebSocketException

    try:
        return await dial(url, compression=None, max_size=None, max_queue=None)
    except InvalidStatus as refused:
        status, body = refused.response.status_code, bytes(refused.response.body)
        text = body.decode("utf-8", "replace").strip() or f"the service answers with the status {status}"
        raise ClientError(text, "token" if status in (401, 403) else "connection") from None
    except WebSocketException as error:
        raise ClientError(f"{url}: {error}") from None
    except OSError as error:
        words = f"{error.strerror or error}: wanted a service at {url}; `realizer serve` starts one"
        raise OSError(error.errno or ECONNREFUSED, words) from error
