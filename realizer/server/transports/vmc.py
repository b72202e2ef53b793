"""The VMC transport: a character as a performer of the Virtual Motion Capture protocol, in OSC over UDP."""

import struct
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES
from realizer.core.settings import Settings
from realizer.outputs.rotations import half_turns, quaternions
from realizer.server.runtime.session_host import SessionHost
from realizer.server.transports.avatar import AvatarTransport

MAX_PACKET = 1400  # bytes, which fit into an Ethernet frame
IMMEDIATELY = 1  # OSC's time tag


class VmcTransport(AvatarTransport):
    """A performer that sends to the marionette at `settings.vmc`.

    It sends the 52 blend shapes under their names in VRM's perfect sync, such as "BrowDownLeft", and the
    rotations of head, neck and eyes. The positions of these bones are 0: it does not know the avatar's.
    """

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.vmc is not None
        super().__init__("vmc", settings.vmc, sessions, settings)

    def packets(self, frame: int, time: float, values: Sequence[float]) -> Iterable[bytes]:
        messages = [_message("/VMC/Ext/OK", 1), _message("/VMC/Ext/T", float(time))]
        for bone, rotation in _bones(values[52:]):
            messages.append(_message("/VMC/Ext/Bone/Pos", bone, 0.0, 0.0, 0.0, *rotation))
        for name, value in zip(ARKIT_NAMES(), values, strict=False):
            messages.append(_message("/VMC/Ext/Blend/Val", name[0].upper() + name[1:], float(value)))
        return _bundles([*messages, _message("/VMC/Ext/Blend/Apply")])


def _bones(turns: Sequence[float]) -> Iterator[tuple[str, list[float]]]:
    """Yield the bones and their quaternions x, y, z, w for head and eyes as the stream arkit has them.

    Unity's x axis is to the character's right, ours to its left.
    """
    yaw, pitch, roll, *eyes = turns
    rows = np.array([[pitch, yaw, roll], [eyes[1], eyes[0], 0], [eyes[3], eyes[2], 0]], np.float32)
    head, left, right = quaternions(rows) * np.array([1, -1, -1, 1], np.float32)
    half = half_turns(head)
    for bone, rotation in (("Neck", half), ("Head", half), ("LeftEye", left), ("RightEye", right)):
        yield bone, rotation.tolist()


def _message(address: str, *values: str | int | float) -> bytes:
    """Return an OSC message."""
    tags = "".join({str: "s", int: "i", float: "f"}[type(value)] for value in values)
    packed = (
        _text(value) if isinstance(value, str) else struct.pack(f">{tag}", value)
        for tag, value in zip(tags, values, strict=True)
    )
    return _text(address) + _text(f",{tags}") + b"".join(packed)


def _text(text: str) -> bytes:
    """Return an OSC string: it ends with a null, and its length is a multiple of 4."""
    return text.encode() + bytes(4 - len(text) % 4)


def _bundles(messages: Iterable[bytes]) -> Iterator[bytes]:
    """Yield OSC bundles of messages, each in one packet."""
    head = b"#bundle\0" + struct.pack(">Q", IMMEDIATELY)
    bundle = head
    for message in messages:
        if len(bundle) + 4 + len(message) > MAX_PACKET:
            yield bundle
            bundle = head
        bundle += struct.pack(">i", len(message)) + message
    yield bundle
