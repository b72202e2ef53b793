"""The Live Link transport: a character as the app Live Link Face sends it to Unreal Engine."""

import struct
import uuid
from collections.abc import Iterable, Sequence

from realizer.animation.arkit import ARKIT_NAMES
from realizer.core.settings import Settings
from realizer.outputs.arkit_csv import SHAPES
from realizer.server.runtime.session_host import SessionHost
from realizer.server.transports.avatar import AvatarTransport

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
        self._head = struct.pack(">B", VERSION) + _text(str(uuid.uuid4()).upper()) + _text(SUBJECT)

    def packets(self, frame: int, time: float, values: Sequence[float]) -> Iterable[bytes]:
        clock = struct.pack(">ifii", frame % 2**31, 0.0, self._fps, 1)
        row = [0.0 if column is None else values[column] for column in self._order]
        return (self._head + clock + struct.pack(f">B{len(row)}f", len(row), *row),)


def _text(text: str) -> bytes:
    return struct.pack(">i", len(text)) + text.encode()
