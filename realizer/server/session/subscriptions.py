"""The subscriptions of a session's clients: `subscribe` and `unsubscribe`."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from realizer.core.settings import Settings, limit_hint
from realizer.playback.character import Cast
from realizer.protocol.messages.common import PICTURES
from realizer.protocol.messages.replies import ErrorMessage, FaceChanged, Subscribed
from realizer.protocol.messages.requests import Subscribe, Unsubscribe
from realizer.protocol.streams import STREAMS
from realizer.server.documents.limits import MAX_CHARACTERS, pixel_rate_error
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import (
    Connection,
    Connections,
    FeedbackFilter,
    ScheduleSubscription,
    Subscription,
    VideoSubscription,
    VideoView,
)
from realizer.server.session.control_fields import FieldError, character_index
from realizer.server.session.effects import RenderOptions
from realizer.server.streams.audio_stream import AudioSubscription
from realizer.server.streams.broadcast import Broadcast
from realizer.server.streams.frame_windows import SOURCES, FrameSubscription, first_frame_at
from realizer.server.streams.frames_ahead import AheadSubscription

# A subscription and the fields of the reply `subscribed`.
_Answer = tuple[Subscription, dict[str, Any]]


@dataclass(eq=False)
class Subscriptions:
    """The subscriptions of a session's connections to its streams."""

    settings: Settings
    cast: Cast
    faces: CharacterFaces
    broadcast: Broadcast
    connections: Connections

    def subscribe(self, connection: Connection, message: Subscribe, t: float) -> None:
        """Subscribe a connection to a stream, replace its earlier subscription, and reply `subscribed`.

        Raises:
            FieldError: the stream has no such encoding, or an option is invalid.
            FaceError: the character's face cannot be loaded.
        """
        stream = message.stream
        encodings = STREAMS[stream].encodings
        encoding = message.encoding or encodings[0]
        if encoding not in encodings:
            raise FieldError("encoding", f"wanted {' or '.join(encodings)} for {stream}, got {encoding}")
        _check_options(message)
        fields: dict[str, Any]
        if stream == "feedback":
            elements = None if message.elements is None else frozenset(message.elements)
            connection.feedback = FeedbackFilter(elements, message.character)
            fields = {"elements": message.elements}
        else:
            index = character_index(self.cast, message.character)
            key = self._key(message)
            old = connection.subscriptions.get(key)
            if stream == "schedule":
                new: Subscription = ScheduleSubscription(
                    None if message.character is None else index, message.character
                )
                fields = {}
            elif stream == "audio":
                new, fields = self._audio(message, index, old, t)
            elif stream == "video":
                new, fields = self._video(connection, message, index, old, t)
            else:
                new, fields = self._frames(message, index, old, t)
            connection.subscriptions[key], connection.requests[key] = new, message
        fields |= {"stream": stream, "encoding": encoding, "character": message.character}
        self.connections.reply(connection.id, Subscribed(**fields))

    def unsubscribe(self, connection: Connection, message: Unsubscribe) -> None:
        """End a subscription. It is no error if there is none."""
        if message.stream == "feedback":
            connection.feedback = None
        connection.subscriptions.pop(self._key(message), None)
        connection.requests.pop(self._key(message), None)

    def renew(self, connection: Connection, t: float) -> None:
        """Subscribe a connection again to its streams, of parts that were made anew, where it had got to."""
        olds, requests = dict(connection.subscriptions), dict(connection.requests)
        connection.subscriptions.clear()
        for key, message in requests.items():
            if key in olds:
                self.subscribe(connection, message, t)
                _go_on(connection.subscriptions[key], olds[key])

    def announce_face_change(self, index: int) -> None:
        """Send the new scale of a character's meshes to their subscribers."""
        for connection, mesh in self.broadcast.face_changed(index):
            fields = {"stream": "mesh", "character": mesh.name, "index": index, "frame": mesh.next}
            self.connections.reply(connection, FaceChanged(**fields, **self._mesh(index)))

    def end_pictures(self, connections: Iterable[Connection], fault: str) -> None:
        """End the subscriptions of connections to pictures, which cannot be drawn."""
        for connection in connections:
            for key in [k for k in connection.subscriptions if k[0] == "video"]:
                del connection.subscriptions[key]
            self.connections.reply(connection.id, ErrorMessage(code="render", message=fault, where="video"))

    def views(self, without: Subscription | None = None) -> list[VideoView]:
        """Return the views that are drawn, each once, without that of one subscription."""
        subscriptions = [s for c in self.connections.values() for s in c.subscriptions.values()]
        videos = [s for s in subscriptions if isinstance(s, VideoSubscription) and s is not without]
        return list({s.view.key: s.view for s in videos}.values())

    # one method for each kind of stream -----------------------------------------------------------

    def _audio(self, message: Subscribe, index: int, old: Subscription | None, t: float) -> _Answer:
        heard = None if message.character is None else index
        new = self.broadcast.subscribe_audio(heard, message.rate, t)
        if isinstance(old, AudioSubscription) and old.sound is new.sound:
            new = old  # do not send again what was sent ahead
        return new, {"index": index, "rate": message.rate, "frame": new.next, "fps": 50.0}

    def _video(
        self, connection: Connection, message: Subscribe, index: int, old: Subscription | None, t: float
    ) -> _Answer:
        fps, options = message.fps or self.settings.fps, self._render_options(message, index)
        new = self.broadcast.subscribe_video(index, fps, options, t)
        others = [view for view in self.views(without=old) if view is not new.view]
        pixel_rate = sum(v.options.size[0] * v.options.size[1] * v.timeline.fps for v in others)
        if (error := pixel_rate_error(message.size, fps, self.settings, pixel_rate)) is not None:
            raise FieldError("fps", error)
        if message.view is not None:
            new.index = _index_of_view(connection, old)
        return new, {
            "index": new.index,
            "fps": fps,
            "frame": new.next,
            "size": message.size,
            "view": message.view,
            "face": self.faces.name(index),
            "media_type": PICTURES[message.format],
        }

    def _frames(self, message: Subscribe, index: int, old: Subscription | None, t: float) -> _Answer:
        stream, fps = message.stream, message.fps or self.settings.fps
        encoding = message.encoding or STREAMS[stream].encodings[0]
        ahead: Any = {"ahead": message.ahead} if message.ahead else {}
        fields = self._mesh(index) if stream == "mesh" else {"names": SOURCES[stream].names()}
        timeline, first = self.broadcast.timeline(index, fps), first_frame_at(t, fps)
        if isinstance(old, FrameSubscription) and old.timeline is timeline:
            # No frame twice, except those that were sent ahead of their time.
            first = max(first, old.final if isinstance(old, AheadSubscription) else old.next)
        make = AheadSubscription if ahead else FrameSubscription
        new = make(stream, encoding, timeline, index, message.character, first, message.asked, **ahead)
        return new, fields | ahead | {"index": index, "fps": fps, "frame": first}

    def _render_options(self, message: Subscribe, index: int) -> RenderOptions:
        from realizer.render.cameras import camera_names
        from realizer.render.light import presets

        settings, largest = self.settings, self.settings.max_size
        if not all(16 <= side <= largest for side in message.size):
            text = f"wanted sides of 16..{largest} pixels, got {list(message.size)} {limit_hint('max_size')}"
            raise FieldError("size", text)
        if message.light is not None and message.light not in presets():
            raise FieldError("light", f"wanted one of {', '.join(presets())}, got {message.light!r}")
        cameras = camera_names(self.faces.of(index))
        if message.camera is not None and message.camera not in cameras:
            raise FieldError("camera", f"wanted one of {', '.join(cameras)}, got {message.camera!r}")
        background = message.background or settings.background
        if message.format == "jpeg" and background == "transparent":
            if message.background is not None:
                raise FieldError("background", "wanted the format png or webp for transparency, got jpeg")
            background = None  # the service's own default: a JPEG has the light's backdrop instead
        return RenderOptions(
            size=message.size,
            camera=message.camera or settings.camera,
            light=message.light or settings.light,
            background=background,
            quality=message.quality,
            form=message.format,
        )

    def _mesh(self, index: int) -> dict[str, Any]:
        from realizer.face.surface import face_scale

        face = self.faces.of(index)
        scale, offset = face_scale(face)
        return {
            "face": self.faces.name(index),
            "vertices": len(face.vertices),
            "scale": float(scale),
            "offset": [float(v) for v in offset],
        }

    def _key(self, message: Subscribe | Unsubscribe) -> tuple[str, str | None, str | None]:
        """Return the key of a subscription: a new one with the same key replaces it.

        Without a name the first character is meant, for sound and schedules all characters. Only videos have
        views.
        """
        stream, character = message.stream, message.character
        if stream not in ("audio", "schedule") and character == self.cast[0].id:
            character = None
        return stream, character, message.view if stream == "video" else None


def _check_options(message: Subscribe) -> None:
    """Raise FieldError for an option of other streams. `fps` is none: every stream can be asked for it."""
    applying = {"type", "stream", "encoding", "fps", *STREAMS[message.stream].options}
    for name in sorted(message.model_fields_set - applying):
        if getattr(message, name) != Subscribe.model_fields[name].default:
            names = " or ".join(row.name for row in STREAMS.values() if name in row.options)
            raise FieldError(name, f"wanted the stream {names}, got {message.stream}")


def _go_on(new: Subscription, old: Subscription) -> None:
    """Begin a subscription where another one was; rows that were sent ahead are sent again."""
    if isinstance(new, AheadSubscription) and isinstance(old, AheadSubscription):
        new.takes_back = old.takes_back or old.next > old.final
        new.next = new.final = max(new.final, old.final)
    elif not isinstance(new, ScheduleSubscription) and not isinstance(old, ScheduleSubscription):
        new.next = max(new.next, old.next)


def _index_of_view(connection: Connection, old: Subscription | None) -> int:
    """Return an index for a view's pictures that no other view of its connection has."""
    if isinstance(old, VideoSubscription):
        return old.index
    others = connection.subscriptions.values()
    free = set(range(MAX_CHARACTERS, 256)) - {s.index for s in others if isinstance(s, VideoSubscription)}
    if not free:
        raise FieldError("view", f"wanted at most {256 - MAX_CHARACTERS} views")
    return min(free)
