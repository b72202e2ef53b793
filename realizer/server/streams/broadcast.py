"""Streams out: what every subscription is due at `now`, and when the next one is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from weakref import WeakValueDictionary

from realizer.playback.player import Player
from realizer.server.session.character_faces import Faces
from realizer.server.session.effects import Effect, Look, Send
from realizer.server.streams.audio_packets import packets_due, send_packets
from realizer.server.streams.audio_stream import PACKET, Sound
from realizer.server.streams.connection import (
    Connection,
    FrameSubscription,
    PictureSubscription,
    PlanSubscription,
    SoundSubscription,
)
from realizer.server.streams.frame_windows import EPSILON, Strip, Timeline, first_at, last_at
from realizer.server.streams.schedule_stream import Plans, message
from realizer.server.streams.video_stream import Pictures

# Frames later than this are not sent at all: what a stalled process owes is not worth catching up with.
LATE = 0.5  # s
# How long after a client was too slow for what is planned it is tried again.
RETRY = 0.1  # s


class Lane:
    """The frames of one timeline and all who get them.

    Attributes:
        members: who, with what of them.
    """

    def __init__(self, timeline: Timeline, members: list[tuple[Connection, FrameSubscription]]) -> None:
        self.timeline = timeline
        self.members = members
        self._strip: Strip | None = None  # of numbers that only one gets: the next ones are slices of it

    @property
    def next(self) -> int:
        """The first frame that somebody has not got."""
        members = self.members
        return members[0][1].next if len(members) == 1 else min(s.next for _, s in members)

    @property
    def strip(self) -> Strip | None:
        """What follows, where only one gets it and it is still what is planned."""
        return self._strip if self.timeline.current else None

    def send(self, newest: int, now: float, sends: list[Send]) -> None:
        """All up to `newest`, to everybody who has not got it."""
        timeline, first = self.timeline, self.next
        oldest = first if first == newest else first_at(now - LATE, timeline.fps)
        window = timeline.window(max(first, oldest), newest)
        for connection, s in self.members:
            if s.next < oldest:
                connection.dropped += oldest - s.next
                s.next = oldest
            if connection.slow:
                connection.dropped += max(0, newest + 1 - s.next)
            else:
                for number in range(s.next, newest + 1):
                    sends.append(Send(connection.id, window.message(s, number)))
            s.next = max(s.next, newest + 1)
        if len(self.members) == 1 and s.encoding == "binary" and s.stream != "mesh" and not connection.slow:
            self._strip = window.strip(s)
        window.settle()


class Run:
    """Frames that need nothing of their session but to be sent: nearly all there are.

    Args:
        connection: who gets them.
        subscription: of theirs; it is told how far they have got.
        strip: the frames.
        zero: when the session's clock was 0, on the caller's clock.

    Attributes:
        connection: who gets them.
        until: something else is due then, on the caller's clock.
        wakes: when `take` is wanted, or something else is due.
    """

    __slots__ = ("_due", "_fps", "_next", "_strip", "_subscription", "_zero", "connection", "until", "wakes")

    def __init__(
        self, connection: int, subscription: FrameSubscription, strip: Strip, zero: float, until: float
    ) -> None:
        self.connection = connection
        self._subscription = subscription
        self._strip = strip
        self._fps = subscription.timeline.fps
        self._zero = zero
        self._next = subscription.next
        self._due = self._next / self._fps + zero
        self.until = until
        self.wakes = min(self._due, until)

    def take(self, now: float) -> bytes | None:
        """The frame that is due as a message; None where none is, or more than one, or something else too."""
        number, passed = self._next, now + EPSILON
        following = (number + 1) / self._fps + self._zero
        if not self._due <= passed < min(following, self.until) or number >= self._strip.end:
            return None
        self._subscription.next = self._next = number + 1
        self._due = following
        self.wakes = min(following, self.until)
        return self._strip[number]


class Broadcast:
    """The timelines, sounds and pictures of one session, each computed once for all who get it.

    Attributes:
        active: a connection has a subscription: otherwise nothing is ever due.
    """

    def __init__(self, player: Player, faces: Faces) -> None:
        self.player = player
        self.pictures = Pictures(faces)
        self._faces = faces
        # Subscriptions hold them: what nobody gets any more is gone, however many rates were asked for.
        self._timelines = WeakValueDictionary[tuple[int, float], Timeline]()
        self._sounds = WeakValueDictionary[tuple[int | None, int], Sound]()
        self._plans = Plans(player.blocks)
        self._lanes: list[Lane] = []
        self._sound_takers: list[tuple[Connection, SoundSubscription]] = []
        self._plan_takers: list[tuple[Connection, PlanSubscription]] = []
        self._picture_takers: list[PictureSubscription] = []
        self.active = False

    def timeline(self, index: int, fps: float) -> Timeline:
        """The frames of one character at one rate."""
        known = self._timelines.get((index, fps))
        if known is None:
            known = self._timelines[index, fps] = Timeline(
                self.player, index, fps, lambda: self._faces.of(index), lambda: self._faces.mapping(index)
            )
        return known

    def frames(
        self, stream: str, encoding: str, index: int, name: str | None, fps: float, now: float
    ) -> FrameSubscription:
        """A subscription to fap, au or mesh, from `now` on."""
        timeline = self.timeline(index, fps)
        return FrameSubscription(stream, encoding, timeline, index, name, first_at(now, fps))

    def sound(self, index: int | None, rate: int, now: float) -> SoundSubscription:
        """A subscription to sound, from `now` on; of one character or of all."""
        sound = self._sounds.setdefault((index, rate), Sound(self.player, rate, index))
        return SoundSubscription(sound, index or 0, math.ceil((now - EPSILON) / PACKET), self.player.version)

    def look(self, index: int, fps: float, look: Look, now: float) -> PictureSubscription:
        """A subscription to pictures, from `now` on."""
        self.active = True  # it may be refused yet: then `due` forgets its view
        return self.pictures.subscription(self.timeline(index, fps), index, look, now)

    def face_changed(self, index: int) -> list[tuple[int, FrameSubscription]]:
        """The face of a character is another one: meshes and pictures follow from the next frame on.

        Returns:
            Who gets meshes of it, each with the id of its connection: they must be told what these mean now.
        """
        for (character, _), timeline in self._timelines.items():
            if character == index:
                timeline.forget()
        self.pictures.face_changed(index)
        members = [member for lane in self._lanes for member in lane.members]
        return [(c.id, s) for c, s in members if s.stream == "mesh" and s.index == index]

    def gets(self, connections: Iterable[Connection]) -> None:
        """Who gets what from now on."""
        lanes: dict[Timeline, list[tuple[Connection, FrameSubscription]]] = {}
        self._plan_takers, self._sound_takers, self._picture_takers = [], [], []
        for connection in connections:
            for s in connection.subscriptions.values():
                if isinstance(s, FrameSubscription):
                    lanes.setdefault(s.timeline, []).append((connection, s))
                elif isinstance(s, SoundSubscription):
                    self._sound_takers.append((connection, s))
                elif isinstance(s, PlanSubscription):
                    self._plan_takers.append((connection, s))
                else:
                    self._picture_takers.append(s)
        self._lanes = [Lane(timeline, members) for timeline, members in lanes.items()]
        self.active = bool(lanes or self._plan_takers or self._sound_takers or self._picture_takers)

    def due(self, now: float, effects: list[Effect]) -> None:
        """Every frame, packet and drawing whose time has come, to those of the last `gets`."""
        self._send_plans(self._plan_takers, now, effects)
        for connection, sound in self._sound_takers:
            send_packets(connection, sound, now, effects)
        effects += self.frames_due(now)[0]
        self.pictures.due(self._picture_takers, now, effects)

    def frames_due(self, now: float) -> tuple[list[Send], float]:
        """Every frame of fap, au, arkit and mesh whose time has come, and when the next one's comes."""
        sends: list[Send] = []
        soonest = math.inf
        for lane in self._lanes:
            fps = lane.timeline.fps
            newest = last_at(now, fps)
            if lane.next <= newest:
                lane.send(newest, now, sends)
            soonest = min(soonest, lane.next / fps)
        return sends, soonest

    def run(self, zero: float, until: float) -> Run | None:
        """The frames that one client alone gets, as long as nothing changes; None where there is more to it.

        Args:
            zero: when the session's clock was 0, on the caller's clock.
            until: when something else is due, on the caller's clock.
        """
        if len(self._lanes) != 1 or (strip := self._lanes[0].strip) is None:
            return None
        ((connection, s),) = self._lanes[0].members
        return Run(connection.id, s, strip, zero, until)

    @property
    def shows_plans(self) -> bool:
        """Somebody follows the stream `schedule`."""
        return bool(self._plan_takers)

    @property
    def next_frame(self) -> float:
        """When `frames_due` will next have something; infinite where nobody gets frames."""
        return min([lane.next / lane.timeline.fps for lane in self._lanes], default=math.inf)

    @property
    def next_other(self) -> float:
        """When `due` will next have something that is no such frame."""
        first = [packets_due(s) for _, s in self._sound_takers]
        first.append(self.pictures.next(self._picture_takers))
        if self._plan_takers:
            changed = self._plans.have_changed()
            first += [s.again for _, s in self._plan_takers if s.behind or changed]
        return min(first)

    # inside -------------------------------------------------------------------------------------

    def _send_plans(
        self, looking: list[tuple[Connection, PlanSubscription]], now: float, effects: list[Effect]
    ) -> None:
        """What has changed, to all who know the rest; all of it to those who do not."""
        if not looking:
            self._plans.forget()
            return
        changes = self._plans.changes()
        for connection, s in looking:
            news = [text for character, text in changes if s.index in (None, character)]
            if connection.slow:
                # What is not sent now is in the whole that is sent later.
                s.behind = s.behind or bool(news)
                s.again = now + RETRY
            elif s.behind:
                s.behind, s.again = False, now
                text = message(now, self._plans.whole(s.index), s.name, whole=True)
                effects.append(Send(connection.id, text))
            elif news:
                effects.append(Send(connection.id, message(now, ",".join(news), s.name, whole=False)))
