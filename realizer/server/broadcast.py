"""Streams out: what every subscription is due at `now`, and when the next one is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

from realizer.animation.mapping import FapMapping
from realizer.player import Player
from realizer.server.connection import (
    Connection,
    FrameSubscription,
    PictureSubscription,
    PlanSubscription,
    SoundSubscription,
    View,
)
from realizer.server.effects import Draw, Effect, Look, Send
from realizer.server.plans import Plans, message
from realizer.server.run import Run
from realizer.server.sound import AHEAD, PACKET, Sound
from realizer.server.streams import EPSILON, Strip, Timeline, first_at, last_at
from realizer.server.wire import FrameKind, pack

if TYPE_CHECKING:
    from realizer.face.model import Face

__all__: list[str] = []

# Frames later than this are not sent at all: what a stalled process owes is not worth catching up with.
LATE = 0.5  # s
# A picture that was not drawn by then never will be.
DRAW_DEADLINE = 10.0  # s
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


class Broadcast:
    """The timelines, sounds and views of one session, each computed once for all who get it.

    Args:
        face: (character index) -> the face its meshes are made of.
        mapping: (character index) -> what its AUs ask of FAPs.
        face_name: (character index) -> its name, for pictures.
    """

    def __init__(
        self,
        player: Player,
        face: Callable[[int], Face],
        mapping: Callable[[int], FapMapping],
        face_name: Callable[[int], str],
    ) -> None:
        self.player = player
        self._face = face
        self._mapping = mapping
        self._face_name = face_name
        # Subscriptions hold them: what nobody gets any more is gone, however many rates were asked for.
        self._timelines = WeakValueDictionary[tuple[int, float], Timeline]()
        self._sounds = WeakValueDictionary[tuple[int | None, int], Sound]()
        self._views: dict[tuple[object, ...], View] = {}
        self._plans = Plans(player.cast)
        self._draws = 0
        self._lanes: list[Lane] = []
        self._sound_takers: list[tuple[Connection, SoundSubscription]] = []
        self._plan_takers: list[tuple[Connection, PlanSubscription]] = []
        self._picture_takers: list[PictureSubscription] = []

    def timeline(self, index: int, fps: float) -> Timeline:
        """The frames of one character at one rate."""
        known = self._timelines.get((index, fps))
        if known is None:
            known = self._timelines[index, fps] = Timeline(
                self.player, index, fps, lambda: self._face(index), lambda: self._mapping(index)
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
        return SoundSubscription(sound, index or 0, math.ceil((now - EPSILON) / PACKET), self.player.revision)

    def pictures(self, index: int, fps: float, look: Look, now: float) -> PictureSubscription:
        """A subscription to pictures, from `now` on."""
        timeline = self.timeline(index, fps)
        face = self._face_name(index)
        view = View(timeline, index, face, look, first_at(now, fps))
        view = self._views.setdefault(view.key, view)
        return PictureSubscription(view, first_at(now, fps))

    def face_changed(self, index: int) -> None:
        """The face of a character is another one: meshes and pictures follow from the next frame on."""
        for (character, _), timeline in self._timelines.items():
            if character == index:
                timeline.forget()
        for view in self._views.values():
            if view.index == index:
                view.face = self._face_name(index)

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

    def due(self, now: float, effects: list[Effect]) -> None:
        """Every frame, packet and drawing whose time has come, to those of the last `gets`."""
        self._send_plans(self._plan_takers, now, effects)
        for connection, sound in self._sound_takers:
            self._send_packets(connection, sound, now, effects)
        effects += self.frames_due(now)[0]
        self._draw(self._picture_takers, now, effects)

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
        first = [self._sound_deadline(s) for _, s in self._sound_takers]
        for s in self._picture_takers:
            view = s.view
            first.append(
                view.begun + DRAW_DEADLINE if view.busy is not None else view.next / view.timeline.fps
            )
        if self._plan_takers:
            changed = self._plans.have_changed()
            first += [s.again for _, s in self._plan_takers if s.behind or changed]
        return min(first, default=math.inf)

    def drawn(
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
                if not isinstance(subscription, PictureSubscription) or subscription.view is not view:
                    continue
                lookers.append(connection)
                if picture is None or view.drawing < subscription.next:
                    continue
                connection.dropped += view.drawing - subscription.next
                subscription.next = view.drawing + 1
                if connection.slow:
                    connection.dropped += 1
                    continue
                time = view.drawing / view.timeline.fps
                data = pack(FrameKind.PICTURE, view.drawing, time, picture, character=view.index)
                effects.append(Send(connection.id, data))
        return effects, lookers

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

    def _send_packets(
        self, connection: Connection, subscription: SoundSubscription, now: float, effects: list[Effect]
    ) -> None:
        sound = subscription.sound
        current = math.floor((now + EPSILON) / PACKET)
        if subscription.revision != self.player.revision:
            subscription.revision = self.player.revision
            # What was sent ahead may no longer be true: take it back from the first packet that changed.
            for number, pcm in sorted(subscription.sent, key=lambda pair: pair[0]):
                if number >= current and sound.packet(number) != pcm:
                    forget = pack(
                        FrameKind.SOUND,
                        number,
                        number * PACKET,
                        b"",
                        character=subscription.index,
                        forget=True,
                    )
                    effects.append(Send(connection.id, forget))
                    subscription.next = number
                    break
        span = sound.span()
        last = math.floor((now + AHEAD + EPSILON) / PACKET)
        if span is None or subscription.next > last:
            return
        for number in range(max(subscription.next, current), last + 1):
            pcm = sound.packet(number)
            subscription.sent.append((number, pcm))
            if pcm is None:
                continue
            if connection.slow:
                connection.dropped += 1
                continue
            data = pack(FrameKind.SOUND, number, number * PACKET, pcm, character=subscription.index)
            effects.append(Send(connection.id, data))
        subscription.next = last + 1

    def _sound_deadline(self, subscription: SoundSubscription) -> float:
        if subscription.revision != self.player.revision:
            return -math.inf
        span = subscription.sound.span()
        if span is None or span[1] <= subscription.next * PACKET:
            return math.inf
        return max(subscription.next * PACKET, math.floor(span[0] / PACKET) * PACKET) - AHEAD

    def _draw(self, pictures: list[PictureSubscription], now: float, effects: list[Effect]) -> None:
        wanted = self._views = {s.view.key: s.view for s in pictures}
        for view in wanted.values():
            fps = view.timeline.fps
            if view.busy is not None and now + EPSILON >= view.begun + DRAW_DEADLINE:
                view.busy = None
            newest = last_at(now, fps)
            if view.busy is not None or newest < view.next:
                continue
            window = view.timeline.window(newest, newest)
            self._draws += 1
            view.busy, view.drawing, view.begun, view.next = self._draws, newest, now, newest + 1
            pose = window.poses[newest - window.first]
            window.settle()
            effects.append(Draw(self._draws, view.face, pose, view.look))
