"""What a game engine receives: the VMC packets of a session, here printed as a bar of the open jaw.

  realizer serve --vmc 127.0.0.1:39539
  python examples/game_engine.py 39539

It needs python-osc. Any receiver of VMC takes the same packets, such as a plug-in of Unity, or VSeeFace.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from socket import AF_INET, SOCK_DGRAM, socket

from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_message import OscMessage


def values(packet: bytes) -> Iterator[tuple[str, float]]:
    """Yield name and value of each shape in a packet."""
    for message in OscBundle(packet) if OscBundle.dgram_is_bundle(packet) else [OscMessage(packet)]:
        if message.address == "/VMC/Ext/Blend/Val":
            name, value = message.params
            yield name, value


def main(port: int, frames: int = 500) -> None:
    shown = 0
    with socket(AF_INET, SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", port))
        while shown < frames:
            for name, value in values(receiver.recv(2048)):
                if name == "JawOpen":
                    print("#" * round(40 * value), flush=True)
                    shown += 1


if __name__ == "__main__":
    if len(sys.argv) <= 1:
        sys.exit(__doc__)
    main(*map(int, sys.argv[1:3]))
