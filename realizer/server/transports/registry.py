"""The registry of transports: one row for each way in beside the WebSocket."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from realizer.core.registry import Registry
from realizer.core.settings import Settings
from realizer.server.transports.transport import Door

# The name is the setting that asks for it; one of a plug-in has no setting and is always asked for.
TRANSPORTS: Registry[Callable[..., Door | None]] = Registry(
    "realizer.transports",
    {
        "asap_ports": "realizer.server.transports.asap:AsapDoor",
        "xface_port": "realizer.server.transports.xface.server:XfaceDoor",
        "xface_player": "realizer.server.transports.xface.player:XfacePlayerDoor",
        "stomp": "realizer.server.transports.stomp:StompDoor",
    },
    wanted="a function or class that takes the session host and the settings",
    accepts=callable,
)


def requested(settings: Settings) -> Iterator[Callable[..., Door | None]]:
    """Yield what makes each transport that the settings ask for."""
    names = [name for name in TRANSPORTS if getattr(settings, name, True) is not None]
    for _, make in TRANSPORTS.working(names):
        yield make
