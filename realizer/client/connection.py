"""Opening of client connections, for `async with` or plain `with`."""

from __future__ import annotations

from types import TracebackType
from typing import Any

from realizer.client.async_client import Client
from realizer.client.message_router import ClientError
from realizer.client.sync_client import SyncClient
from realizer.protocol.messages.common import PROTOCOL


def connect(url: str, *, token: str | None = None) -> PendingConnection:
    """`async with connect("ws://127.0.0.1:8765/ws?session=show") as client`, or `with` and no event loop.

    Without a session's name it is one of the client's own.

    Args:
        token: what a service that asks for one wants to hear.

    Raises:
        OSError: nobody listens there.
        ClientError: the service speaks another version of the protocol, wants another token, or refuses what
            the address says; or it is no such service.
    """
    return PendingConnection(url, token)


class PendingConnection:
    """What `connect` gives: a Client inside `async with`, a SyncClient inside `with`."""

    def __init__(self, url: str, token: str | None = None) -> None:
        self._url = url
        self._token = token
        self._dial: Any = None
        self._client: Client | None = None
        self._sync_client: SyncClient | None = None

    async def __aenter__(self) -> Client:
        from websockets.asyncio.client import connect as dial
        from websockets.exceptions import InvalidStatus, WebSocketException

        try:
            self._dial = dial(self._url, compression=None, max_size=None, max_queue=None)
            socket = await self._dial.__aenter__()
        except InvalidStatus as refused:
            raise _refusal(refused.response.status_code, bytes(refused.response.body)) from None
        except WebSocketException as error:
            raise ClientError(f"{self._url}: {error}") from None
        self._client = Client(socket, self._url, lambda url: PendingConnection(url, self._token))
        said = {"version": PROTOCOL} if self._token is None else {"version": PROTOCOL, "token": self._token}
        try:
            self._client.welcome = await self._client.ask("hello", **said)
        except BaseException:
            await self._client.close()
            raise
        return self._client

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._client is not None
        await self._client.close()

    def __enter__(self) -> SyncClient:
        self._sync_client = SyncClient(PendingConnection(self._url, self._token))
        return self._sync_client

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._sync_client is not None
        self._sync_client.close()


def _refusal(status: int, body: bytes) -> ClientError:
    """Why a service lets nobody in, in its own words."""
    said = body.decode("utf-8", "replace").strip() or f"the service answers with the status {status}"
    return ClientError(said, "token" if status in (401, 403) else "connection")
