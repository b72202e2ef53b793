"""Transports that show a session on an avatar in another program, by UDP: VMC, and Live Link Face."""

import asyncio
import json
import struct
import uuid
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES
from realizer.core.settings import Settings
from realizer.face.glb_file import half_turns, quaternions
from realizer.outputs.csv_table import SHAPES
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.reconnecting import ReconnectingTransport

LOOK_INTERVAL = 0.2  # s; how often the session to show is looked for


class AvatarTransport(ReconnectingTransport):
    """A transport that sends each ARKit frame of a session's first character in UDP packets.

    The session is `settings.avatar_session`, or the oldest one that has a client. It makes no difference
    whether a program receives the packets.
    """

    unsent_bytes = 0  # packets do not wait for a receiver

    def __init__(self, name: str, peer: str, sessions: SessionHost, settings: Settings) -> None:
        super().__init__(name, peer)
        self._sessions = sessions
        self._session = settings.avatar_session
        shown = "the oldest session with a client" if self._session is None else f"session {self._session}"
        self.startup_lines = (f"{name}: {peer} shows {shown}",)
        self._fps = settings.avatar_fps
        self._shown: str | None = None
        self._number = 0
        self._udp: asyncio.DatagramTransport | None = None

    @abstractmethod
    def packets(self, frame: int, time: float, values: Sequence[float]) -> Iterable[bytes]:
        """Return the packets of a frame of the stream arkit: its number, its seconds and its 59 values."""

    def send(self, data: str | bytes) -> None:
        if self._udp is None or not isinstance(data, str) or not data.startswith("{"):
            return
        message = json.loads(data)
        if message["type"] == "arkit":
            for packet in self.packets(message["frame"], message["time"], message["values"]):
                self._udp.sendto(packet)

    def disconnect(self, code: int, reason: str) -> None:
        self._loop.call_soon(self._show, None)  # the session is looked for again

    async def _serve(self, connected: Callable[[], None]) -> str:
        try:
            self._udp, _ = await self._loop.create_datagram_endpoint(
                asyncio.DatagramProtocol, remote_addr=self._address
            )
            self._follow()
            connected()
            self._up.set()
            while True:
                await asyncio.sleep(LOOK_INTERVAL)
                self._follow()
        except JoinError as error:
            return str(error)
        except OSError as error:
            return f"cannot send to {self._peer} ({error.strerror or error})"
        finally:
            self._show(None)
            if self._udp is not None:
                self._udp.close()
                self._udp = None

    def _follow(self) -> None:
        self._show(self._session or self._sessions.oldest_in_use(AvatarTransport))

    def _show(self, session: str | None) -> None:
        if session == self._shown:
            return
        if self._shown is not None:
            self._shown = None
            self._sessions.leave(self._number)
        if session is not None:
            self._number = self._sessions.join(self, session)
            self._shown = session
            wanted = {"type": "subscribe", "stream": "arkit", "encoding": "json", "fps": self._fps}
            for message in ({"type": "unsubscribe", "stream": "feedback"}, wanted):
                self._sessions.receive(self._number, json.dumps(message))


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
    head = b"#bundle\0" + struct.pack(">Q", IMMEDIATELY)
    bundle = head
    for message in messages:
        if len(bundle) + 4 + len(message) > MAX_PACKET:
            yield bundle
            bundle = head
        bundle += struct.pack(">i", len(message)) + message
    yield bundle


VERSION = 6
SUBJECT = "bml-realizer"
# Packets have these the other way round than the app's files.
SWAPPED = {
    "JawLeft": "JawRight", "JawRight": "JawLeft", "MouthLeft": "MouthRight", "MouthRight": "MouthLeft",
}  # fmt: skip
HEAD_AND_EYES = (52, 53, 54, 55, 56, None, 57, 58, None)  # eyes do not roll


class LivelinkTransport(AvatarTransport):
    """A device that sends to the Live Link source at `settings.livelink`."""

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.livelink is not None
        super().__init__("livelink", settings.livelink, sessions, settings)
        names = [SWAPPED.get(name, name) for name in SHAPES]
        weights = [ARKIT_NAMES().index(name[0].lower() + name[1:]) for name in names]
        self._order = (*weights, *HEAD_AND_EYES)
        self._head = (
            struct.pack(">B", VERSION) + _counted_text(str(uuid.uuid4()).upper()) + _counted_text(SUBJECT)
        )

    def packets(self, frame: int, time: float, values: Sequence[float]) -> Iterable[bytes]:
        clock = struct.pack(">ifii", frame % 2**31, 0.0, self._fps, 1)
        row = [0.0 if column is None else values[column] for column in self._order]
        return (self._head + clock + struct.pack(f">B{len(row)}f", len(row), *row),)


def _counted_text(text: str) -> bytes:
    return struct.pack(">i", len(text)) + text.encode()
