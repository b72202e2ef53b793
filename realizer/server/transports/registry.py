"""The registry of transports beside the WebSocket."""

import logging
from collections.abc import Callable, Iterator
from functools import partial

from realizer.core.registry import Registry
from realizer.core.settings import Settings
from realizer.server.transports.transport import Transport

log = logging.getLogger(__name__)

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
    """Yield the factories of the transports that the settings request; where one of a plug-in fails, None."""
    names = [name for name in TRANSPORTS if getattr(settings, name, name) is not None]
    for name, make in TRANSPORTS.working(names):
        yield make if hasattr(settings, name) else partial(_made, name, make)


def _made(name: str, make: Callable[..., Transport | None], *arguments: object) -> Transport | None:
    try:
        return make(*arguments)
    except Exception as error:
        log.warning("the transport of the plug-in %s is not open: %s: %s", name, type(error).__name__, error)
        return None
