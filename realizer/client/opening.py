"""Opening of client connections, for `async with` and `with`."""

from __future__ import annotations

from realizer.client.async_client import Client
from realizer.client.connection import Connection
from realizer.client.sync_client import SyncClient


def connect(url: str, *, token: str | None = None, reconnect: bool = True) -> PendingConnection:
    """Connect: `async with connect("ws://127.0.0.1:8765/ws?session=show") as client`, or `with`.

    Without the name of a session the client gets a new one, which ends with the connection. A lost connection
    to a named session is opened again for up to a minute, while calls wait. Then the missed feedback comes,
    subscriptions go on, and so do blocks that the service had acknowledged; ClientError is raised for others,
    for open speeches, and if the session has not been kept.

    Args:
        token: of the service, if it requires one.
        reconnect: whether to open a lost connection again; if not, calls raise ClientError at once.

    Raises:
        OSError: nothing listens at the address.
        ClientError: the address is not of such a service, which may have another version of the protocol, or
            it refuses the token or the session.
        TypeError: `url` is no string.
    """
    if not isinstance(url, str):
        raise TypeError(f"url: wanted a string such as ws://127.0.0.1:8765/ws, got {url!r}")
    return PendingConnection(url, token, reconnect)


class PendingConnection:
    """A connection to be opened: `async with` returns a Client, `with` a SyncClient."""

    def __init__(self, url: str, token: str | None, reconnect: bool) -> None:
        self._url = url
        self._token = token
        self._reconnect = reconnect
        self._client: Client | None = None
        self._sync_client: SyncClient | None = None

    async def __aenter__(self) -> Client:
        connection = Connection(self._url, self._token, reconnect=self._reconnect)
        await connection.open()
        self._client = Client(connection, lambda url: PendingConnection(url, self._token, reconnect=False))
        return self._client

    async def __aexit__(self, *_: object) -> None:
        assert self._client is not None
        await self._client.close()

    def __enter__(self) -> SyncClient:
        self._sync_client = SyncClient(PendingConnection(self._url, self._token, self._reconnect))
        return self._sync_client

    def __exit__(self, *_: object) -> None:
        assert self._sync_client is not None
        self._sync_client.close()
