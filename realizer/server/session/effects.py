"""Effects: what a session asks its host to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

from realizer.core.array_types import Float32
from realizer.protocol.messages.requests import Save
from realizer.speech.utterance import SpeechRequest


class Sight(Protocol):
    """What a picture shows of a face."""

    units: Mapping[str, float]  # action units by name, 0..1, with those of head and eyes
    head: tuple[float, float, float]  # degrees of pitch, yaw and roll
    emotion: str | None  # the recognised one, or None
    certainty: float


class Tracker(Protocol):
    """Measures the face in the pictures of one camera, one after the other."""

    def __call__(self, picture: bytes, time: float, /) -> Sight | None:
        """Return what a picture at a time in seconds shows, or None; raises RealizerError if it is none."""


class Send(NamedTuple):
    """One WebSocket message to one connection."""

    connection: int
    data: str | bytes


@dataclass(frozen=True, slots=True)
class Speak:
    """Synthesize speech and call `session.on_speech(id, utterance or error, now)`."""

    id: int
    request: SpeechRequest


@dataclass(frozen=True, slots=True)
class RenderOptions:
    """Options of a picture, as `realizer.render.Renderer` takes them."""

    size: tuple[int, int]  # width and height in pixels
    camera: str
    light: str | None
    background: str | None
    quality: int  # 1..100, of a JPEG or a WebP
    form: str = "jpeg"  # "jpeg", "png" or "webp"


@dataclass(frozen=True, slots=True, eq=False)
class Draw:
    """Draw one picture and call `session.on_picture(id, its bytes or error, now)`.

    `pose` is (k,) float32, one value for each of the face's inputs.
    """

    id: int
    face: str
    pose: Float32
    options: RenderOptions


@dataclass(frozen=True, slots=True)
class MoveConnection:
    """Move a connection to another session, send `welcome` and the feedback after `seen`."""

    connection: int
    session: str
    seen: int | None


@dataclass(frozen=True, slots=True)
class Close:
    """Close a connection with a WebSocket close code and reason."""

    connection: int
    code: int
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Look at a picture of a face and call `session.on_sight(id, what it shows, None or error, now)`.

    `id` is the number of the connection that sent it, `time` seconds on the session clock.
    """

    id: int
    tracker: Tracker
    picture: bytes
    time: float


@dataclass(frozen=True, slots=True, eq=False)
class Write:
    """Save a file in a folder and send the reply to the connection `id`."""

    id: int
    message: Save
    folder: Path


Effect = Send | Speak | Draw | Look | Write | MoveConnection | Close
