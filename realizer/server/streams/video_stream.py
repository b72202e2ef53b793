"""Pictures out: what is to be drawn now, each once for all who look at it, and who gets what was drawn."""

from __future__ import annotations

import math
from collections.abc import Iterable

from realizer.protocol.wire import pack
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.effects import Draw, Effect, RenderOptions, Send
from realizer.server.streams.connection import Connection, VideoSubscription, VideoView
from realizer.server.streams.frame_windows import EPSILON, FrameTimeline, first_frame_at, last_frame_at

# A picture that was not drawn by then never will be.
DEADLINE = 10.0  # s


class VideoStream:
    """The views of one session. Each is drawn one picture at a time, the newest."""

    def __init__(self, faces: CharacterFaces) -> None:
        self._faces = faces
        self._views: dict[tuple[object, ...], VideoView] = {}
        self._draws = 0

    def subscription(
        self, timeline: FrameTimeline, index: int, look: RenderOptions, now: float
    ) -> VideoSubscription:
        """A look at one character, from `now` on."""
        first = first_frame_at(now, timeline.fps)
        view = VideoView(timeline, index, self._faces.name(index), look, first)
        return VideoSubscription(self._views.setdefault(view.key, view), first, index)

    def face_changed(self, index: int) -> None:
        """The next pictures show another face."""
        for view in self._views.values():
            if view.index == index:
                view.face = self._faces.name(index)

    def due(self, subscribers: list[VideoSubscription], now: float, effects: list[Effect]) -> None:
        """Ask for every picture whose time has come."""
        self._views = {s.view.key: s.view for s in subscribers}
        for view in self._views.values():
            fps = view.timeline.fps
            if view.busy is not None and now + EPSILON >= view.started_at + DEADLINE:
                view.busy = None
            newest = last_frame_at(now, fps)
            if view.busy is not None or newest < view.next:
                continue
            window = view.timeline.window(newest, newest)
            self._draws += 1
            view.busy, view.drawing, view.started_at, view.next = self._draws, newest, now, newest + 1
            pose = window.poses[newest - window.first]
            window.drop_source()
            effects.append(Draw(self._draws, view.face, pose, view.options))

    @staticmethod
    def next(subscribers: list[VideoSubscription]) -> float:
        """When `due` will next have something."""
        times = (
            s.view.started_at + DEADLINE if s.view.busy is not None else s.view.next / s.view.timeline.fps
            for s in subscribers
        )
        return min(times, default=math.inf)

    def on_picture(
        self, draw: int, picture: bytes | None, connections: Iterable[Connection]
    ) -> tuple[list[Effect], list[Connection]]:
        """A picture is there, or (None) cannot be: what to send, and who looked at it."""
        view = next((v for v in self._views.values() if v.busy == draw), None)
        if view is None:
            return [], []
        view.busy = None
        effects: list[Effect] = []
        lookers = []
        for connection in connections:
            for subscription in connection.subscriptions.values():
                if not isinstance(subscription, VideoSubscription) or subscription.view is not view:
                    continue
                lookers.append(connection)
                if picture is None or view.drawing < subscription.next:
                    continue
                connection.dropped += view.drawing - subscription.next
                subscription.next = view.drawing + 1
                if connection.is_slow:
                    connection.dropped += 1
                    continue
                time = view.drawing / view.timeline.fps
                data = pack("video", view.drawing, time, picture, character=subscription.index)
                effects.append(Send(connection.id, data))
        return effects, lookers
