"""Streams out: what every subscription is due at `now`, and when the next one is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from weakref import WeakValueDictionary

from realizer.playback.player import Player
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.effects import Effect, RenderOptions, Send
from realizer.server.streams.audio_packets import packets_due, send_packets
from realizer.server.streams.audio_stream import PACKET, AudioStream
from realizer.server.streams.connection import (
    AudioSubscription,
    Connection,
    FrameSubscription,
    ScheduleSubscription,
    VideoSubscription,
)
from realizer.server.streams.frame_windows import (
    EPSILON,
    FrameTimeline,
    PackedFrames,
    first_frame_at,
    last_frame_at,
)
from realizer.server.streams.schedule_stream import ScheduleStream, schedule_message
from realizer.server.streams.video_stream import VideoStream

# Frames later than this are not sent at all: what a stalled process owes is not worth catching up with.
LATE = 0.5  # s
# How long after a client was too slow for what is planned it is tried again.
RETRY = 0.1  # s


class Fanout:
    """The frames of one timeline and all who get them.

    Attributes:
        members: who, with what of them.
    """

    def __init__(self, timeline: FrameTimeline, members: list[tuple[Connection, FrameSubscription]]) -> None:
        self.timeline = timeline
        self.members = members
        self._packed: PackedFrames | None = (
            None  # of numbers that only one gets: the next ones are slices of it
        )

    @property
    def next(self) -> int:
        """The first frame that somebody has not got."""
        members = self.members
        return members[0][1].next if len(members) == 1 else min(s.next for _, s in members)

    @property
    def packed(self) -> PackedFrames | None:
        """What follows, where only one gets it and it is still what is planned."""
        return self._packed if self.timeline.is_current else None

    def send(self, newest: int, now: float, sends: list[Send]) -> None:
        """All up to `newest`, to everybody who has not got it."""
        timeline, first = self.timeline, self.next
        oldest = first if first == newest else first_frame_at(now - LATE, timeline.fps)
        window = timeline.window(max(first, oldest), newest)
        for connection, s in self.members:
            if s.next < oldest:
                connection.dropped += oldest - s.next
                s.next = oldest
            if connection.is_slow:
                connection.dropped += max(0, newest + 1 - s.next)
            else:
                for number in range(s.next, newest + 1):
                    sends.append(Send(connection.id, window.message(s, number)))
            s.next = max(s.next, newest + 1)
        if (
            len(self.members) == 1
            and s.encoding == "binary"
            and s.stream != "mesh"
            and not connection.is_slow
        ):
            self._packed = window.packed(s)
        window.drop_source()


class FrameRun:
    """Frames that need nothing of their session but to be sent: nearly all there are.

    Args:
        connection: who gets them.
        subscription: of theirs; it is told how far they have got.
        strip: the frames.
        zero: when the session's clock was 0, on the caller's clock.

    Attributes:
        connection: who gets them.
        until: something else is due then, on the caller's clock.
        wake_at: when `next_message` is wanted, or something else is due.
    """

    __slots__ = (
        "_due",
        "_fps",
        "_next",
        "_strip",
        "_subscription",
        "_zero",
        "connection",
        "until",
        "wake_at",
    )

    def __init__(
        self, connection: int, subscription: FrameSubscription, strip: PackedFrames, zero: float, until: float
    ) -> None:
        self.connection = connection
        self._subscription = subscription
        self._strip = strip
        self._fps = subscription.timeline.fps
        self._zero = zero
        self._next = subscription.next
        self._due = self._next / self._fps + zero
        self.until = until
        self.wake_at = min(self._due, until)

    def next_message(self, now: float) -> bytes | None:
        """The frame that is due as a message; None where none is, or more than one, or something else too."""
        number, passed = self._next, now + EPSILON
        following = (number + 1) / self._fps + self._zero
        if not self._due <= passed < min(following, self.until) or number >= self._strip.end:
            return None
        self._subscription.next = self._next = number + 1
        self._due = following
        self.wake_at = min(following, self.until)
        return self._strip[number]


class Broadcast:
    """The timelines, sounds and pictures of one session, each computed once for all who get it.

    Attributes:
        active: a connection has a subscription: otherwise nothing is ever due.
    """

    def __init__(self, player: Player, faces: CharacterFaces) -> None:
        self.player = player
        self.video = VideoStream(faces)
        self._faces = faces
        # Subscriptions hold them: what nobody gets any more is gone, however many rates were asked for.
        self._timelines = WeakValueDictionary[tuple[int, float], FrameTimeline]()
        self._audio = WeakValueDictionary[tuple[int | None, int], AudioStream]()
        self._schedules = ScheduleStream(player.blocks)
        self._fanouts: list[Fanout] = []
        self._audio_subscribers: list[tuple[Connection, AudioSubscription]] = []
        self._schedule_subscribers: list[tuple[Connection, ScheduleSubscription]] = []
        self._video_subscribers: list[VideoSubscription] = []
        self.active = False

    def timeline(self, index: int, fps: float) -> FrameTimeline:
        """The frames of one character at one rate."""
        known = self._timelines.get((index, fps))
        if known is None:
            known = self._timelines[index, fps] = FrameTimeline(
                self.player, index, fps, lambda: self._faces.of(index), lambda: self._faces.mapping(index)
            )
        return known

    def subscribe_frames(
        self, stream: str, encoding: str, index: int, name: str | None, fps: float, now: float
    ) -> FrameSubscription:
        """A subscription to fap, au or mesh, from `now` on."""
        timeline = self.timeline(index, fps)
        return FrameSubscription(stream, encoding, timeline, index, name, first_frame_at(now, fps))

    def subscribe_audio(self, index: int | None, rate: int, now: float) -> AudioSubscription:
        """A subscription to sound, from `now` on; of one character or of all."""
        sound = self._audio.setdefault((index, rate), AudioStream(self.player, rate, index))
        return AudioSubscription(sound, index or 0, math.ceil((now - EPSILON) / PACKET), self.player.version)

    def subscribe_video(self, index: int, fps: float, look: RenderOptions, now: float) -> VideoSubscription:
        """A subscription to pictures, from `now` on."""
        self.active = True  # it may be refused yet: then `send_due` forgets its view
        return self.video.subscription(self.timeline(index, fps), index, look, now)

    def face_changed(self, index: int) -> list[tuple[int, FrameSubscription]]:
        """The face of a character is another one: meshes and pictures follow from the next frame on.

        Returns:
            Who gets meshes of it, each with the id of its connection: they must be told what these mean now.
        """
        for (character, _), timeline in self._timelines.items():
            if character == index:
                timeline.invalidate()
        self.video.face_changed(index)
        members = [member for lane in self._fanouts for member in lane.members]
        return [(c.id, s) for c, s in members if s.stream == "mesh" and s.index == index]

    def set_subscribers(self, connections: Iterable[Connection]) -> None:
        """Who gets what from now on."""
        lanes: dict[FrameTimeline, list[tuple[Connection, FrameSubscription]]] = {}
        self._schedule_subscribers, self._audio_subscribers, self._video_subscribers = [], [], []
        for connection in connections:
            for s in connection.subscriptions.values():
                if isinstance(s, FrameSubscription):
                    lanes.setdefault(s.timeline, []).append((connection, s))
                elif isinstance(s, AudioSubscription):
                    self._audio_subscribers.append((connection, s))
                elif isinstance(s, ScheduleSubscription):
                    self._schedule_subscribers.append((connection, s))
                else:
                    self._video_subscribers.append(s)
        self._fanouts = [Fanout(timeline, members) for timeline, members in lanes.items()]
        self.active = bool(
            lanes or self._schedule_subscribers or self._audio_subscribers or self._video_subscribers
        )

    def send_due(self, now: float, effects: list[Effect]) -> None:
        """Every frame, packet and drawing whose time has come, to those of the last `set_subscribers`."""
        self._send_schedules(self._schedule_subscribers, now, effects)
        for connection, sound in self._audio_subscribers:
            send_packets(connection, sound, now, effects)
        effects += self.frames_due(now)[0]
        self.video.due(self._video_subscribers, now, effects)

    def frames_due(self, now: float) -> tuple[list[Send], float]:
        """Every frame of fap, au, arkit and mesh whose time has come, and when the next one's comes."""
        sends: list[Send] = []
        soonest = math.inf
        for lane in self._fanouts:
            fps = lane.timeline.fps
            newest = last_frame_at(now, fps)
            if lane.next <= newest:
                lane.send(newest, now, sends)
            soonest = min(soonest, lane.next / fps)
        return sends, soonest

    def fast_path(self, zero: float, until: float) -> FrameRun | None:
        """The frames that one client alone gets, as long as nothing changes; None where there is more to it.

        Args:
            zero: when the session's clock was 0, on the caller's clock.
            until: when something else is due, on the caller's clock.
        """
        if len(self._fanouts) != 1 or (strip := self._fanouts[0].packed) is None:
            return None
        ((connection, s),) = self._fanouts[0].members
        return FrameRun(connection.id, s, strip, zero, until)

    @property
    def has_schedule_subscribers(self) -> bool:
        """Somebody follows the stream `schedule`."""
        return bool(self._schedule_subscribers)

    @property
    def next_frame(self) -> float:
        """When `frames_due` will next have something; infinite where nobody gets frames."""
        return min([lane.next / lane.timeline.fps for lane in self._fanouts], default=math.inf)

    @property
    def next_other(self) -> float:
        """When `send_due` will next have something that is no such frame."""
        first = [packets_due(s) for _, s in self._audio_subscribers]
        first.append(self.video.next(self._video_subscribers))
        if self._schedule_subscribers:
            changed = self._schedules.has_changes()
            first += [s.retry_at for _, s in self._schedule_subscribers if s.needs_full_update or changed]
        return min(first)

    # inside -------------------------------------------------------------------------------------

    def _send_schedules(
        self, looking: list[tuple[Connection, ScheduleSubscription]], now: float, effects: list[Effect]
    ) -> None:
        """What has changed, to all who know the rest; all of it to those who do not."""
        if not looking:
            self._schedules.reset()
            return
        changes = self._schedules.changes()
        for connection, s in looking:
            news = [text for character, text in changes if s.index in (None, character)]
            if connection.is_slow:
                # What is not sent now is in the whole that is sent later.
                s.needs_full_update = s.needs_full_update or bool(news)
                s.retry_at = now + RETRY
            elif s.needs_full_update:
                s.needs_full_update, s.retry_at = False, now
                text = schedule_message(now, self._schedules.full_message(s.index), s.name, whole=True)
                effects.append(Send(connection.id, text))
            elif news:
                effects.append(
                    Send(connection.id, schedule_message(now, ",".join(news), s.name, whole=False))
                )
