"""The base of transports that listen on a TCP port."""

import asyncio
import ipaddress
import logging
import re
import socket
from abc import ABC, abstractmethod
from collections.abc import Iterable

from realizer.core.settings import is_loopback, limit_hint

log = logging.getLogger(__name__)

LONGEST_NAME = 64  # characters of a session's name
BACKLOG = 1024  # connections that wait until they are accepted


def session_name(transport: str, host: str) -> str:
    """Return the name of the session that the clients of an address share."""
    return (f"{transport}-" + re.sub(r"[^A-Za-z0-9._~-]", "-", host))[:LONGEST_NAME]


class TcpTransport(ABC):
    """The base of transports that listen on a TCP port; `port` is the open one after `start`.

    Args:
        allow: addresses and networks whose clients are accepted, beside this machine; none: all.
    """

    def __init__(self, name: str, host: str, port: int, most: int, allow: Iterable[str] = ()) -> None:
        self.port = port
        self._name = name
        self._host = host
        self._most = most
        self._allowed = [ipaddress.ip_network(network) for network in allow]
        self._from: list[str] = []  # the addresses of the open connections
        self._server: asyncio.Server | None = None
        self._clients: dict[asyncio.Task[None], asyncio.StreamWriter] = {}

    def __len__(self) -> int:
        """Return the number of connected clients."""
        return len(self._clients)

    @property
    def address(self) -> str:
        """HOST:PORT."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"{host}:{self.port}"

    async def start(self) -> None:
        self._server = await asyncio.start_server(self._serve, self._host, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def ready(self) -> None:
        return

    def stop_accepting(self) -> None:
        if self._server is not None:
            self._server.close()

    async def close(self) -> None:
        """Stop listening and abort all open connections."""
        self.stop_accepting()
        for writer in self._clients.values():
            writer.transport.abort()
        await asyncio.gather(*self._clients, return_exceptions=True)

    @abstractmethod
    async def _handle(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve the client at an IP address until it leaves."""

    def _is_allowed(self, host: str) -> bool:
        if not self._allowed or is_loopback(host):
            return True
        return bool(host) and any(ipaddress.ip_address(host) in network for network in self._allowed)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients[task] = writer
        peer = writer.get_extra_info("peername")
        host = "" if peer is None else peer[0].removeprefix("::ffff:")
        self._from.append(host)
        try:
            if not self._is_allowed(host):
                log.warning("%s: %s is refused: REALIZER_ALLOW does not name it", self._name, host)
            elif self._from.count(host) > self._most:
                words = (
                    f"{self._most} connections from it are open: wanted fewer {limit_hint('max_connections')}"
                )
                log.warning("%s: %s is refused: %s", self._name, host, words)
            elif peer is not None:  # None: it has already left
                # The protocols have no heartbeat, and a host that loses power closes nothing.
                writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
                await self._handle(host, reader, writer)
        except OSError:
            pass  # the client has gone
        except Exception:
            log.exception("%s: %s is disconnected: its connection failed", self._name, host)
        finally:
            writer.transport.abort()
            self._from.remove(host)
            del self._clients[task]


async def listen(host: str, port: int) -> list[socket.socket]:
    """Return sockets that listen at all addresses of a host, on one port.

    Raises:
        OSError: an address is not available.
    """
    addresses = await asyncio.get_running_loop().getaddrinfo(
        host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    sockets: list[socket.socket] = []
    try:
        for family, _, _, _, address in dict.fromkeys(addresses):
            there = (address[0], sockets[0].getsockname()[1] if sockets else port)
            listener = socket.create_server(there, family=family, backlog=BACKLOG)
            listener.setblocking(False)
            sockets.append(listener)
    except OSError:
        for listener in sockets:
            listener.close()
        raise
    return sockets
