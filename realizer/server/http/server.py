"""The HTTP server of the service: the application under uvicorn's protocols, on one port or behind others."""

import asyncio
import contextlib
import socket
from typing import Any

import uvicorn
from uvicorn.server import ServerState

from realizer.core.settings import Settings
from realizer.server.http.access import EVERYWHERE
from realizer.server.http.app import application
from realizer.server.http.hub import Hub
from realizer.server.http.protocols import GOODBYE, OPENING, Connection, SocketProtocol
from realizer.server.transports.tcp_listener import BACKLOG, listen

PING_INTERVAL, PING_TIMEOUT = 20.0, 60.0  # s


class HttpServer:
    """The transport of everything on `settings.port`; `port` is the open one after `start`.

    It has uvicorn's configuration and protocols, but not its server, which would disconnect all clients
    before what plays has ended.
    """

    def __init__(self, hub: Hub) -> None:
        self.port = hub.settings.port
        self._hub = hub
        self._settings = hub.settings
        self._state = ServerState()
        self._listening: list[asyncio.Server] = []
        self._connections: set[Connection] = set()
        self._tasks: set[asyncio.Task[Any]] = set()

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
        return startup_lines(self._settings, self.port) if self._listening else ()

    async def start(self) -> None:
        self._config = uvicorn.Config(
            application(self._hub),
            ws=SocketProtocol,
            ws_max_size=self._settings.max_message,
            ws_ping_interval=PING_INTERVAL,
            ws_ping_timeout=PING_TIMEOUT,
            ws_per_message_deflate=False,  # frames are dense, and a late one is worse than a large one
            lifespan="off",
            log_config=None,
            log_level="error",  # lower levels log addresses of requests, with their tokens
            access_log=False,
            proxy_headers=bool(self._settings.forwarded_allow_ips),
            forwarded_allow_ips=list(self._settings.forwarded_allow_ips),
        )
        self._config.load()
        if self._hub.worker is not None:
            return  # connections come by `serve_socket`
        tls = self._hub.access.tls()
        sockets = await listen(self._settings.host, self.port)
        self.port = sockets[0].getsockname()[1]
        options: dict[str, Any] = {"ssl": tls, "ssl_handshake_timeout": OPENING} if tls else {}
        loop = asyncio.get_running_loop()
        for each in sockets:
            self._listening.append(
                await loop.create_server(self._connection, sock=each, backlog=BACKLOG, **options)
            )

    def serve_socket(self, client: socket.socket) -> None:
        """Serve a connection that another process has accepted."""
        loop = asyncio.get_running_loop()
        task = loop.create_task(loop.connect_accepted_socket(self._connection, client))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _connection(self) -> Connection:
        return Connection(
            self._settings.max_rate,
            self._hub.sessions.metrics.counts,
            self._connections,
            config=self._config,
            server_state=self._state,
            app_state={},
        )

    async def ready(self) -> None:
        return

    def stop_accepting(self) -> None:
        for server in self._listening:
            server.close()

    async def close(self) -> None:
        """Disconnect all clients, in a bounded time."""
        self.stop_accepting()
        await self._hub.disconnect()
        for protocol in list(self._state.connections):
            if not getattr(protocol, "close_sent", False):
                protocol.shutdown()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(GOODBYE):
                while self._connections:
                    await next(iter(self._connections)).closed.wait()
        for connection in list(self._connections):
            connection.transport.abort()
        if self._state.tasks:
            await asyncio.wait(self._state.tasks, timeout=GOODBYE)


def startup_lines(settings: Settings, port: int) -> tuple[str, ...]:
    """Return the lines that a service prints when its port is open."""
    service, page = _addresses(settings, port)
    return f"listening on {service}", f"page at {page}"


def _addresses(settings: Settings, port: int) -> tuple[str, str]:
    host = EVERYWHERE.get(settings.host, settings.host)
    place, s = f"[{host}]:{port}" if ":" in host else f"{host}:{port}", "s" if settings.tls_cert else ""
    return f"ws{s}://{place}/ws", f"http{s}://{place}/"
