"""The WebSocket transport: sessions at /ws, checks at /check, HTTP beside them."""

import asyncio
import os
import socket
import tempfile
from collections.abc import Mapping
from typing import Any
from weakref import WeakSet

from websockets.asyncio.server import Server as SocketServer
from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as listen
from websockets.http11 import Request, Response
from websockets.protocol import State

from realizer.core.settings import Settings
from realizer.server.http.access import EVERYWHERE, AccessControl
from realizer.server.http.connections import WebSocketConnections
from realizer.server.http.requests import SOCKETS, HttpRequests, address_of, headers_of, path_of, response_to
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.websocket.protocol import GOODBYE, Connection, Protocol, WebSocketClient

PATIENCE: Mapping[str, Any] = {"ping_interval": 20, "ping_timeout": 60}  # s
OPENING = 10.0  # s; time for the HTTP request


class WebSocketTransport:
    """The WebSocket and HTTP server at `settings.host`; `port` is the open one after `start`.

    Args:
        worker: number of this process among several: then connections come by `serve_socket` only.
    """

    def __init__(self, sessions: SessionHost, settings: Settings, *, worker: int | None = None) -> None:
        self.port = settings.port
        self._listens = worker is None
        self._tasks: set[asyncio.Task[Any]] = set()
        self._sessions = sessions
        self._settings = settings
        self._access = AccessControl(settings)
        self._connections = WebSocketConnections(sessions, settings, self._access)
        self._requests = HttpRequests(sessions, settings, self._access, worker or 0)
        self._socket: SocketServer | None = None
        self._opened = WeakSet[ServerConnection]()
        self._closing: set[asyncio.Task[None]] = set()

    @property
    def url(self) -> str:
        """The address of the WebSocket."""
        return _addresses(self._settings, self.port)[0]

    @property
    def page(self) -> str:
        """The address of the page."""
        return _addresses(self._settings, self.port)[1]

    @property
    def startup_lines(self) -> tuple[str, ...]:
        return startup_lines(self._settings, self.port) if self._listens else ()

    async def start(self) -> None:
        options: dict[str, Any] = {"create_connection": self._open, **PATIENCE}
        if self._listens:
            options |= {"host": self._settings.host, "port": self.port, "ssl": self._access.tls()}
        else:
            options |= {"unix": True, "sock": _unreachable_socket()}
        self._socket = await listen(
            lambda socket: self._connections.serve(WebSocketClient(socket)),
            process_request=self._http,
            compression=None,  # frames are dense, and a late one is worse than a large one
            open_timeout=OPENING,
            close_timeout=GOODBYE,
            server_header=None,
            **options,
        )
        if self._listens:
            self.port = next(iter(self._socket.sockets)).getsockname()[1]

    def serve_socket(self, client: socket.socket) -> None:
        """Serve a connection that another process has accepted."""
        loop = asyncio.get_running_loop()
        task = loop.create_task(loop.connect_accepted_socket(self._connection, client))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _connection(self) -> ServerConnection:
        assert self._socket is not None
        return self._open(None, self._socket, close_timeout=GOODBYE, **PATIENCE)

    def _open(self, _: object, server: SocketServer, **named: Any) -> ServerConnection:
        """Return the connection to a new client. The library offers a protocol, which ours replaces."""
        counts = self._sessions.metrics.counts
        protocol = Protocol(counts, max_size=self._settings.max_message)
        connection = Connection(protocol, server, self._settings.max_rate, counts, **named)
        self._opened.add(connection)
        return connection

    async def ready(self) -> None:
        return

    def stop_accepting(self) -> None:
        if self._socket is not None:
            self._socket.close(close_connections=False)

    async def close(self) -> None:
        if self._socket is not None:
            self._socket.close(close_connections=False)
            for connection in list(self._opened):
                # Its request may never come. Without a transport, before the TLS handshake, it times out.
                if connection.state is State.CONNECTING and hasattr(connection, "transport"):
                    connection.transport.abort()
            for socket in list(self._socket.connections):
                # The server was closed above or by `stop_accepting`, without its connections.
                self._closing.add(asyncio.create_task(socket.close(1001, "the service ends")))
            await self._socket.wait_closed()

    async def _http(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; return None if a WebSocket may be opened."""
        target, headers, address = request.path, headers_of(request), address_of(connection)
        upgrade = headers.get("upgrade", "").lower() == "websocket"
        try:
            self._access.check_host(headers)
            if upgrade and path_of(target) in SOCKETS:
                self._connections.admit(target, headers, address)
                return None
            answer = await self._requests.answer(target, headers, upgrade=upgrade)
        except JoinError as error:
            answer = self._requests.refuse(error, address)
        return response_to(answer, self._access.origin_of_reader(target, headers))


def _unreachable_socket() -> socket.socket:
    """Return a socket that no client can reach: the library's server must listen to serve at all."""
    listener = socket.socket(socket.AF_UNIX)
    # In a container nothing else may be writable.
    parent = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        listener.bind(f"{folder}/s")
    listener.setblocking(False)
    return listener


def startup_lines(settings: Settings, port: int) -> tuple[str, ...]:
    """Return the lines that a service prints when its port is open."""
    service, page = _addresses(settings, port)
    return f"listening on {service}", f"page at {page}"


def _addresses(settings: Settings, port: int) -> tuple[str, str]:
    host = EVERYWHERE.get(settings.host, settings.host)
    place, s = f"[{host}]:{port}" if ":" in host else f"{host}:{port}", "s" if settings.tls_cert else ""
    return f"ws{s}://{place}/ws", f"http{s}://{place}/"
