"""The protocols of transports and of their clients, and the registry of transports beside the WebSocket."""

import logging
from collections.abc import Callable, Iterator
from functools import partial
from typing import Protocol

from realizer.core.registry import Registry
from realizer.core.settings import Settings

log = logging.getLogger(__name__)


class Outbound(Protocol):
    """The way out to one client. Called in the event loop; never blocks."""

    @property
    def unsent_bytes(self) -> int:
        """Bytes that wait for the network."""

    def send(self, data: str | bytes) -> None:
        """Send a message of the session: feedback, a reply or a frame; ignore those the client cannot use."""

    def disconnect(self, code: int, reason: str) -> None:
        """Close the connection; the codes are those of WebSocket."""


class Transport(Protocol):
    """A transport, by which clients reach sessions: `start`, wait for `ready`, `stop_accepting`, `close`."""

    @property
    def startup_lines(self) -> tuple[str, ...]:
        """The lines to print when the transport is ready: its addresses."""

    async def start(self) -> None:
        """Open the transport.

        Raises:
            OSError: the address is not available.
            RealizerError: a package is not installed.
        """

    async def ready(self) -> None:
        """Return once clients can connect; if that depends on other programs, this may take for ever."""

    def stop_accepting(self) -> None:
        """Accept no new clients. Connected ones stay."""

    async def close(self) -> None:
        """Disconnect all clients. Called once, after a `start` that succeeded."""


# The name is the setting that requests the transport. One of a plug-in has none and is always requested.
TRANSPORTS: Registry[Callable[..., Transport | None]] = Registry(
    "realizer.transports",
    {
        "asap_ports": "realizer.server.transports.asap:AsapTransport",
        "xface_port": "realizer.server.transports.xface.server:XfaceTransport",
        "xface_player": "realizer.server.transports.xface.player:XfacePlayerTransport",
        "vmc": "realizer.server.transports.avatar:VmcTransport",
        "livelink": "realizer.server.transports.avatar:LivelinkTransport",
        "stomp": "realizer.server.transports.stomp:StompTransport",
    },
    wanted="a function or class that takes the session host and the settings",
    accepts=callable,
)


def requested(settings: Settings) -> Iterator[Callable[..., Transport | None]]:
    """Yield the factories of the transports that the settings request; one of a plug-in may return None."""
    names = [name for name in TRANSPORTS if getattr(settings, name, name) is not None]
    for name, make in TRANSPORTS.working(names):
        yield make if hasattr(settings, name) else partial(_made, name, make)


def _made(name: str, make: Callable[..., Transport | None], *arguments: object) -> Transport | None:
    try:
        return make(*arguments)
    except Exception as error:
        log.warning("the transport of the plug-in %s is not open: %s: %s", name, type(error).__name__, error)
        return None
