"""Effects: what a session asks its host to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from realizer.core.array_types import Float32
from realizer.speech.utterance import SpeechRequest


class Send(NamedTuple):
    """One WebSocket message to one connection."""

    connection: int
    data: str | bytes


@dataclass(frozen=True, slots=True)
class Speak:
    """Let a voice say it and answer `session.spoken(id, utterance or error, now)`."""

    id: int
    request: SpeechRequest


@dataclass(frozen=True, slots=True)
class RenderOptions:
    """How pictures are drawn: `size` is width, height; the rest as `realizer.render.Renderer` takes it.

    Attributes:
        quality: of a JPEG or a WebP.
        form: "jpeg", "png" or "webp".
    """

    size: tuple[int, int]
    camera: str
    light: str | None
    background: str | None
    quality: int
    form: str = "jpeg"


@dataclass(frozen=True, slots=True, eq=False)
class Draw:
    """Draw one picture and answer `session.on_picture(id, its bytes or error, now)`.

    `pose` is (k,) float32, a column for each thing the face takes.
    """

    id: int
    face: str
    pose: Float32
    options: RenderOptions


@dataclass(frozen=True, slots=True)
class MoveConnection:
    """Take a connection to another session and let it have the feedback after `seen`; then say welcome."""

    connection: int
    session: str
    seen: int | None


@dataclass(frozen=True, slots=True)
class Close:
    """Close a connection, with the code and the reason of the WebSocket close."""

    connection: int
    code: int
    reason: str


Effect = Send | Speak | Draw | MoveConnection | Close
