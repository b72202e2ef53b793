"""The stream `video`: requests to draw due pictures, and their distribution."""

import math
from collections.abc import Iterable

from realizer.core.errors import RealizerError
from realizer.protocol.wire import pack
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connection, Drawing, VideoSubscription, VideoView
from realizer.server.session.effects import Draw, Effect, RenderOptions, Send
from realizer.server.streams.frame_windows import EPSILON, FrameTimeline, first_frame_at, last_frame_at

# A picture that takes longer is given up.
DEADLINE = 10.0  # s


class VideoStream:
    """The views of one session. A view has one picture at a time in progress, the newest."""

    def __init__(self, faces: CharacterFaces) -> None:
        self._faces = faces
        self._views: dict[tuple[object, ...], VideoView] = {}
        self._draws = 0

    def subscription(
        self, timeline: FrameTimeline, index: int, options: RenderOptions, now: float
    ) -> VideoSubscription:
        """Return a subscription to a view of one character from `now` on."""
        first = first_frame_at(now, timeline.fps)
        view = VideoView(timeline, index, self._faces.name(index), options, first)
        return VideoSubscription(self._views.setdefault(view.key, view), first, index)

    def face_changed(self, index: int) -> None:
        """Show a character's new face in the next pictures."""
        for view in self._views.values():
            if view.index == index:
                view.face = self._faces.name(index)

    def due(self, subscribers: list[VideoSubscription], now: float, effects: list[Effect]) -> None:
        """Request the pictures that are due."""
        self._views = {s.view.key: s.view for s in subscribers}
        for view in self._views.values():
            fps = view.timeline.fps
            if view.drawing is not None and now + EPSILON >= view.drawing.begun + DEADLINE:
                view.drawing = None
            newest = last_frame_at(now, fps)
            if view.drawing is not None or newest < view.next:
                continue
            window = view.timeline.window(newest, newest)
            self._draws += 1
            view.drawing, view.next = Drawing(self._draws, newest, now), newest + 1
            pose = window.poses[newest - window.first]
            window.drop_source()
            effects.append(Draw(self._draws, view.face, pose, view.options))

    @staticmethod
    def next(subscribers: list[VideoSubscription]) -> float:
        """Return the time of the next picture; infinity without subscribers."""
        times = (
            view.drawing.begun + DEADLINE if view.drawing is not None else view.next / view.timeline.fps
            for view in (s.view for s in subscribers)
        )
        return min(times, default=math.inf)

    def on_picture(
        self, draw: int, picture: bytes | RealizerError, connections: Iterable[Connection]
    ) -> tuple[list[Effect], list[Connection]]:
        """Take a picture, or the error if it failed. Return what to send, and the view's connections."""
        view = next((v for v in self._views.values() if v.drawing and v.drawing.id == draw), None)
        if view is None or view.drawing is None:
            return [], []
        frame, view.drawing = view.drawing.frame, None
        effects: list[Effect] = []
        viewers = []
        for connection in connections:
            for s in connection.subscriptions.values():
                if not isinstance(s, VideoSubscription) or s.view is not view:
                    continue
                viewers.append(connection)
                if not isinstance(picture, bytes) or frame < s.next:
                    continue
                connection.dropped += frame - s.next + connection.is_slow
                s.next = frame + 1
                if not connection.is_slow:
                    time = frame / view.timeline.fps
                    data = pack("video", frame, time, picture, character=s.index)
                    effects.append(Send(connection.id, data))
        return effects, viewers
