"""Faces in the pictures of clients, which drive characters."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from realizer.core.errors import PluginError, RealizerError
from realizer.core.registry import Registry
from realizer.playback.character import Cast
from realizer.protocol.messages.replies import ErrorMessage, Tracked
from realizer.protocol.messages.requests import Track
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import HEADER
from realizer.server.session.connections import Connections
from realizer.server.session.control_fields import character_index
from realizer.server.session.effects import Look, Sight, Tracker

# What measures faces in pictures, by name; the first one is used. Each takes nothing and returns a tracker.
TRACKERS: Registry[Callable[[], Tracker]] = Registry(
    "realizer.trackers",
    {},
    wanted="a function or class without arguments that returns a tracker",
    accepts=callable,
)

PICTURE = bytes([STREAMS["video"].kind or 0])  # first byte of a picture
EARLY = 0.8  # of the time between two pictures; one that comes sooner is left out
LEAST = 0.02  # a smaller action unit is not shown


@dataclass(eq=False)
class _Camera:
    """The pictures of one connection."""

    character: str | None
    fps: float
    tracker: Tracker
    last: tuple[float, int] = (float("-inf"), 0)  # time and number of the picture that was looked at last
    is_busy: bool = False
    waiting: bytes | None = None  # the newest picture while another one is looked at


@dataclass(eq=False)
class TrackedFaces:
    """Looks at the newest picture of each connection, one at a time, and makes its character show the face.

    Pictures are neither kept nor written to the journal; what characters show is, as messages `set`.

    Args:
        show: handles a message of a connection, as if a client had sent it.
    """

    cast: Cast
    connections: Connections
    show: Callable[[int, str, float], object]
    cameras: dict[int, _Camera] = field(default_factory=dict)  # by connection

    def start(self, connection: int, message: Track) -> None:
        """Make a character follow the pictures of a connection; at 0 frames a second, no longer.

        Raises:
            FieldError: the session has too many characters.
            PluginError: no tracker is installed.
        """
        self.cameras.pop(connection, None)
        if message.fps:
            character_index(self.cast, message.character)
            if not TRACKERS:
                raise PluginError("no tracker of faces is installed (group realizer.trackers)")
            make = TRACKERS[next(iter(TRACKERS))]
            self.cameras[connection] = _Camera(message.character, message.fps, make())

    def drop(self, connection: int) -> None:
        """Forget the camera of a connection."""
        self.cameras.pop(connection, None)

    def receive(self, connection: int, message: bytes, t: float) -> bool:
        """Look at a picture, or let it wait in the place of an earlier one; return False if it is none."""
        if message[:1] != PICTURE:
            return False
        camera = self.cameras.get(connection)
        if camera is None or len(message) <= HEADER.size:
            text = "a picture behind the header" if camera else "`track` before pictures"
            self.connections.reply(connection, ErrorMessage(code="unsupported", message=f"wanted {text}"))
        elif camera.is_busy:
            camera.waiting = message
        elif t - camera.last[0] >= EARLY / camera.fps:
            _, _, _, number, _ = HEADER.unpack_from(message)
            camera.last, camera.is_busy, camera.waiting = (t, number), True, None
            self.connections.add_effects([Look(connection, camera.tracker, message[HEADER.size :], t)])
        return True

    def answer(self, connection: int, result: Sight | RealizerError | None, t: float) -> None:
        """Take what a picture shows; then look at the next one."""
        camera = self.cameras.get(connection)
        if camera is None:
            return
        camera.is_busy = False
        time, number = camera.last
        if isinstance(result, RealizerError):
            fault = ErrorMessage(code="unsupported", message=str(result), where="track")
            self.connections.reply(connection, fault)
        else:
            seen: dict[str, Any] = {}
            if result is not None:
                seen = {name: getattr(result, name) for name in ("head", "emotion", "certainty")}
                seen["aus"] = result.units
                shown = {name: value if value >= LEAST else None for name, value in result.units.items()}
                message = {"type": "set", "aus": shown, "character": camera.character}
                self.show(connection, json.dumps(message), t)
            face = result is not None
            answer = Tracked(character=camera.character, frame=number, time=time, face=face, **seen)
            self.connections.reply(connection, answer)
        if camera.waiting is not None:
            self.receive(connection, camera.waiting, t)
