"""The connection of a client: its WebSocket, and the requests that are sent over it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from errno import ECONNREFUSED
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from realizer.client.block_waiters import BlockWaiter
from realizer.client.errors import ClientError, ClosedError, LostError
from realizer.client.message_router import Router
from realizer.protocol.messages.common import PROTOCOL

# Pauses before attempts to connect again, each twice as long as the last, and how long attempts go on.
PAUSE, LONGEST_PAUSE = 0.25, 4.0  # s
PATIENCE = 60.0  # s; a service keeps a session without clients as long
REFUSED = 1008  # the code with which a service closes a connection whose token is wrong or has expired
_LOG = logging.getLogger("realizer.client")


class Connection:
    """A connection to a service, which `open` opens.

    If it is lost, it is opened again: the service sends the feedback that was missed, and subscriptions and
    the pending request are sent again. A session without a name ends with its connection.

    Args:
        url: address of the service's WebSocket.
        token: of the service, if it requires one.
        reconnect: whether to open it again.

    Attributes:
        router: what has arrived.
    """

    def __init__(self, url: str, token: str | None = None, *, reconnect: bool = True) -> None:
        self.url = url
        self.router = Router()
        self._token = {} if token is None else {"token": token}
        self._returns = reconnect and bool(dict(parse_qsl(urlsplit(url).query)).get("session"))
        self._socket: Any = None
        self._is_open = False
        self._received = asyncio.Condition()
        self._end: ClientError | None = None  # why nothing more comes
        self._reader: asyncio.Task[None] | None = None
        self._asking = asyncio.Lock()  # requests wait in the order in which they are sent
        # stream, character and view -> the message
        self._subscriptions: dict[tuple[Any, ...], str] = {}
        self._interrupted: list[BlockWaiter] = []  # what was waited for when the connection was lost

    async def open(self) -> None:
        """Connect. Errors as of `connect`."""
        await self._join(self.url)
        self._reader = asyncio.create_task(self._read())

    async def post(self, message: str | bytes) -> None:
        """Send a message as soon as the connection is open.

        Raises:
            ClientError: the connection has ended.
        """
        from websockets.exceptions import ConnectionClosed

        while True:
            await self.wait_for(lambda: self._is_open)
            socket = self._socket
            try:
                return await socket.send(message)  # type: ignore[no-any-return]
            except ConnectionClosed:  # the reader knows why
                self._is_open &= socket is not self._socket

    async def control(self, type: str, **fields: Any) -> None:
        """Send a control message. Errors as of `post`."""
        if type == "unsubscribe":
            self._subscriptions.pop(_key(fields), None)
            if not self._is_open:  # the next connection will not have it
                return
        await self.post(json.dumps({"type": type, **fields}))

    async def ask(self, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer, or until it is taken. Errors as of `Client.ask`."""
        if type == "unsubscribe":
            self._subscriptions.pop(_key(fields), None)
        requests = self.router.requests
        async with self._asking:
            request = requests.add(type, fields)
            try:
                for text in request.texts:
                    await self.post(text)
            except BaseException:
                if request in requests.waiting:
                    requests.waiting.remove(request)
                raise
            request.is_sent = True
        await self.wait_for(lambda: request.reply is not None)
        assert request.reply is not None
        if request.reply["type"] == "error":
            raise ClientError.of(request.reply)
        if type == "subscribe":
            self._subscriptions[_key(fields)] = request.texts[0]
        return {} if request.mark else request.reply

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
            self._reader.cancel()
            await asyncio.wait([self._reader])

    async def _read(self) -> None:
        try:
            while True:
                try:
                    await self._receive()
                except LostError as lost:
                    self._is_open = False
                    if self._end is not None or not self._returns:
                        raise
                    await self._reconnect(lost)
                await self._notify()
        except ClientError as end:
            self._end = self._end or end
        except Exception as fault:
            self._end = self._end or ClientError(f"a message of the service cannot be read: {fault!r}")
        finally:
            self._is_open = False
            await self._socket.close()
            await self._notify()

    async def _notify(self) -> None:
        async with self._received:
            self._received.notify_all()

    async def _receive(self) -> None:
        with _closing():
            while True:
                self.router.receive(await self._socket.recv())
                await self._notify()

    async def _reconnect(self, lost: LostError) -> None:
        """Open the connection again.

        Raises:
            ClientError: the service refuses it, or was not there for PATIENCE seconds.
        """
        _LOG.warning("%s: connecting again", lost)
        self._interrupted = self.router.waiters.on_lost()
        self.router.requests.on_lost()
        await self._notify()
        session, pause, until = self.router.welcome["session"], PAUSE, time.monotonic() + PATIENCE
        while True:
            await asyncio.sleep(pause)
            pause = min(2 * pause, LONGEST_PAUSE)
            try:
                return await self._join(address_of(self.url, session=session, seen=str(self.router.seen)))
            except (OSError, LostError) as error:
                if time.monotonic() >= until:
                    words = f"{lost}, and there was no new one for {PATIENCE:g} s: {error}"
                    raise ClientError(words) from None

    async def _join(self, url: str) -> None:
        """Open a WebSocket, and restore what another one had."""
        socket = await _dial(url)
        try:
            with _closing():
                await socket.send(json.dumps({"type": "hello", "version": PROTOCOL, **self._token}))
                before = self.router.welcome
                while self.router.welcome is before:  # missed feedback comes first
                    message = await socket.recv()
                    reply = json.loads(message) if str(message).startswith("{") else {}
                    if reply.get("type") == "error" and str(reply.get("where")).startswith("hello"):
                        raise ClientError.of(reply)
                    if reply.get("type") == "gap":
                        self.router.on_gap(self._interrupted)
                    self.router.receive(message)
                self.router.on_return(self._interrupted)
                self._socket, self._is_open = socket, True
                again = [r.texts[0] for r in self.router.requests.waiting if r.is_sent]
                for text in (*again, *self._subscriptions.values()):
                    await socket.send(text)
        except BaseException:
            self._is_open = False
            await socket.close()
            raise


def _key(subscription: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(subscription.get(name) for name in ("stream", "character", "view"))


@contextlib.contextmanager
def _closing() -> Iterator[None]:
    """Turn the end of a WebSocket into LostError, or ClientError if the service wants no other one."""
    from websockets.exceptions import ConnectionClosed

    try:
        yield
    except ConnectionClosed as closed:
        reason = f": {closed.rcvd.reason}" if closed.rcvd is not None and closed.rcvd.reason else ""
        is_refused = closed.rcvd is not None and closed.rcvd.code == REFUSED
        kind = ClientError if is_refused else LostError
        raise kind(f"the connection has ended{reason}") from None


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
        if status >= 500 or status == 429:  # a full or overloaded service
            raise LostError(text) from None
        raise ClientError(text, "token" if status in (401, 403) else "connection") from None
    except WebSocketException as error:
        raise LostError(f"{url}: {error}") from None
    except OSError as error:
        words = f"{error.strerror or error}: wanted a service at {url}; `realizer serve` starts one"
        raise OSError(error.errno or ECONNREFUSED, words) from error
