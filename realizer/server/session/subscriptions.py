"""A message `subscribe` in; what a connection gets from then on, and what it is told of it, out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from realizer.animation.axis import AU_NAMES
from realizer.core.settings import raises
from realizer.protocol.messages.common import PICTURES, STREAMS
from realizer.protocol.messages.replies import Changed, Subscribed
from realizer.protocol.messages.requests import Subscribe, Unsubscribe
from realizer.server.documents.limits import MAX_CHARACTERS, too_many_pixels
from realizer.server.session.control_fields import Wrong, index_of
from realizer.server.session.effects import Look
from realizer.server.streams.connection import (
    Connection,
    FeedbackFilter,
    FrameSubscription,
    PictureSubscription,
    PlanSubscription,
    SoundSubscription,
    Subscription,
)
from realizer.server.streams.frame_windows import arkit_names
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.server.session.session import Session

# Stream of numbers -> what they are.
NAMES = {
    "fap": lambda: [row.name for row in faps()],
    "au": lambda: list(AU_NAMES()),
    "arkit": arkit_names,
}


@dataclass(frozen=True)
class _Asked:
    """What somebody asks for.

    Attributes:
        index: of the character.
        old: what it has of that already.
        t: seconds on the session clock.
    """

    session: Session
    connection: Connection
    message: Subscribe
    encoding: str
    index: int
    old: Subscription | None
    t: float

    @property
    def fps(self) -> float:
        return self.message.fps or self.session.settings.fps


def subscribe(session: Session, connection: Connection, message: Subscribe, t: float) -> None:
    """Give a connection a stream, in the place of the one it has of that kind, and tell what it is.

    Raises:
        Wrong: it cannot be had.
        FaceError: its face cannot be loaded.
    """
    stream = message.stream
    encoding = message.encoding or STREAMS[stream][0]
    if encoding not in STREAMS[stream]:
        raise Wrong("encoding", f"wanted {' or '.join(STREAMS[stream])} for {stream}, got {encoding}")
    told: dict[str, Any]
    if stream == "feedback":
        elements = None if message.elements is None else frozenset(message.elements)
        connection.feedback = FeedbackFilter(elements, message.character)
        told = {"elements": message.elements}
    else:
        index = index_of(session, message.character)
        key = _key(session, message)
        asked = _Asked(session, connection, message, encoding, index, connection.subscriptions.get(key), t)
        connection.subscriptions[key], told = _MADE.get(stream, _frames)(asked)
    told |= {"stream": stream, "encoding": encoding, "character": message.character}
    session.reply(connection.id, Subscribed(**told))


def unsubscribe(session: Session, connection: Connection, message: Unsubscribe) -> None:
    """End a stream; one that does not run has ended."""
    if message.stream == "feedback":
        connection.feedback = None
    connection.subscriptions.pop(_key(session, message), None)


def tell_face(session: Session, index: int) -> None:
    """A character has another face: say to who gets meshes of it what these mean from now on."""
    for connection, mesh in session.broadcast.face_changed(index):
        told = {"stream": "mesh", "character": mesh.name, "index": index, "frame": mesh.next}
        session.reply(connection, Changed(**told, **_mesh_of(session, index)))


# each gives the subscription, and what is told of it -----------------------------------------------


def _plans(asked: _Asked) -> tuple[Subscription, dict[str, Any]]:
    name = asked.message.character
    return PlanSubscription(None if name is None else asked.index, name), {}


def _sound(asked: _Asked) -> tuple[Subscription, dict[str, Any]]:
    message, old = asked.message, asked.old
    one = None if message.character is None else asked.index
    made = asked.session.broadcast.sound(one, message.rate, asked.t)
    if isinstance(old, SoundSubscription) and old.sound is made.sound:
        made = old  # what was sent ahead is not sent again
    return made, {"index": asked.index, "rate": message.rate, "frame": made.next, "fps": 50.0}


def _pictures(asked: _Asked) -> tuple[Subscription, dict[str, Any]]:
    session, message, index, fps = asked.session, asked.message, asked.index, asked.fps
    made = session.broadcast.look(index, fps, _look(session, message, index), asked.t)
    views = [view for view in session.views(but=asked.old) if view is not made.view]
    beside = sum(view.look.size[0] * view.look.size[1] * view.timeline.fps for view in views)
    if (beyond := too_many_pixels(message.size, fps, session.settings, beside)) is not None:
        raise Wrong("fps", beyond)
    if message.view is not None:
        made.index = _index_of_view(asked)
    return made, {
        "index": made.index,
        "fps": fps,
        "frame": made.next,
        "size": message.size,
        "view": message.view,
        "face": session.faces.name(index),
        "media_type": PICTURES[message.format],
    }


def _frames(asked: _Asked) -> tuple[Subscription, dict[str, Any]]:
    session, message, index, old = asked.session, asked.message, asked.index, asked.old
    stream, fps = message.stream, asked.fps
    told = _mesh_of(session, index) if stream == "mesh" else {"names": NAMES[stream]()}
    made = session.broadcast.frames(stream, asked.encoding, index, message.character, fps, asked.t)
    made.asked = message.asked
    if isinstance(old, FrameSubscription) and old.timeline is made.timeline:
        made.next = max(made.next, old.next)  # no frame twice
    return made, told | {"index": index, "fps": fps, "frame": made.next}


_MADE = {"schedule": _plans, "audio": _sound, "video": _pictures}  # the others are frames


def _look(session: Session, message: Subscribe, index: int) -> Look:
    from realizer.render.cameras import camera_names
    from realizer.render.light import presets

    settings = session.settings
    largest = settings.max_size
    if not all(16 <= side <= largest for side in message.size):
        words = f"wanted sides of 16..{largest} pixels, got {list(message.size)} {raises('max_size')}"
        raise Wrong("size", words)
    if message.light is not None and message.light not in presets():
        raise Wrong("light", f"wanted one of {', '.join(presets())}, got {message.light!r}")
    face = session.faces.of(index)
    if message.camera is not None and message.camera not in camera_names(face):
        raise Wrong("camera", f"wanted one of {', '.join(camera_names(face))}, got {message.camera!r}")
    behind = message.background or settings.background
    if message.format == "jpeg" and behind == "transparent":
        if message.background is not None:
            raise Wrong("background", "wanted the format png or webp for what is transparent, got jpeg")
        behind = None  # the service's own: a JPEG has the light's backdrop instead
    return Look(
        size=message.size,
        camera=message.camera or settings.camera,
        light=message.light or settings.light,
        background=behind,
        quality=message.quality,
        form=message.format,
    )


def _mesh_of(session: Session, index: int) -> dict[str, Any]:
    from realizer.face.surface import face_scale

    face = session.faces.of(index)
    scale, offset = face_scale(face)
    return {
        "face": session.faces.name(index),
        "vertices": len(face.vertices),
        "scale": float(scale),
        "offset": [float(v) for v in offset],
    }


def _key(session: Session, message: Subscribe | Unsubscribe) -> tuple[str, str | None, str | None]:
    """What a subscription is replaced by; the first character is who is meant where nobody is named.

    But of sound and plans: those that name nobody are of all. Only videos have views.
    """
    stream, character = message.stream, message.character
    if stream not in ("audio", "schedule") and character == session.player.characters[0]:
        character = None
    return stream, character, message.view if stream == "video" else None


def _index_of_view(asked: _Asked) -> int:
    """What tells the pictures of a view from all others of a connection, and of no view; as it was before."""
    if isinstance(asked.old, PictureSubscription):
        return asked.old.index
    others = asked.connection.subscriptions.values()
    free = set(range(MAX_CHARACTERS, 256)) - {s.index for s in others if isinstance(s, PictureSubscription)}
    if not free:
        raise Wrong("view", f"wanted at most {256 - MAX_CHARACTERS} views")
    return min(free)
