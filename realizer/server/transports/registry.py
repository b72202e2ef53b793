"""The registry of transports beside the WebSocket."""

from collections.abc import Callable, Iterator

from realizer.core.registry import Registry
from realizer.core.settings import Settings
from realizer.server.transports.transport import Transport

# The name is the setting that requests the transport. One of a plug-in has none and is always requested.
TRANSPORTS: Registry[Callable[..., Transport | None]] = Registry(
    "realizer.transports",
    {
        "asap_ports": "realizer.server.transports.asap:AsapTransport",
        "xface_port": "realizer.server.transports.xface.server:XfaceTransport",
        "xface_player": "realizer.server.transports.xface.player:XfacePlayerTransport",
        "vmc": "realizer.server.transports.vmc:VmcTransport",
        "livelink": "realizer.server.transports.livelink:LivelinkTransport",
        "stomp": "realizer.server.transports.stomp:StompTransport",
    },
    wanted="a function or class that takes the session host and the settings",
    accepts=callable,
)


def requested(settings: Settings) -> Iterator[Callable[..., Transport | None]]:
    """Yield the factories of the transports that the settings request."""
    names = [name for name in TRANSPORTS if getattr(settings, name, name) is not None]
    for _, make in TRANSPORTS.working(names):
        yield make
