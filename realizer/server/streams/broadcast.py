"""The broadcast of a session: it sends due frames, packets, pictures and schedules to subscribers."""

import logging
import math
from collections import Counter
from collections.abc import Iterable
from weakref import WeakValueDictionary

from realizer.playback.player import Player
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connection, ScheduleSubscription, VideoSubscription
from realizer.server.session.effects import Effect, RenderOptions, Send
from realizer.server.streams.audio_stream import PACKET, AudioStream, AudioSubscription
from realizer.server.streams.frame_windows import (
    EPSILON,
    FrameSubscription,
    FrameTimeline,
    first_frame_at,
    last_frame_at,
)
from realizer.server.streams.frames_ahead import AheadSubscription
from realizer.server.streams.schedule_stream import ScheduleStream
from realizer.server.streams.video_stream import VideoStream

log = logging.getLogger(__name__)

LATE = 0.1  # s; it begins when all sessions have been woken later than this
PERIOD = 2.0  # s; for so long
TIMELY = 0.05  # s; it ends when none has been woken later than this
RECOVERY = 5.0  # s; for so long
# Frames that are later than this, after the process stalled, are not sent.
OUTDATED = 0.5  # s


class Overload:
    """Whether a process is overloaded.

    Then it opens no new sessions, and of frames that are late it sends the newest only: all sessions get
    fewer frames, instead of frames that are later and later.
    """

    def __init__(self) -> None:
        self.is_active = False
        self._late_since = math.inf  # all were woken later than LATE since then
        self._noted = -math.inf
        self._behind = -math.inf  # when one was last woken later than TIMELY

    def note(self, late: float, now: float) -> None:
        """Note that a session was woken `late` seconds after its time."""
        if late <= LATE:
            self._late_since = math.inf
        elif self._late_since > now or now - self._noted > PERIOD:
            self._late_since = now
        if late > TIMELY:
            self._behind = now
        self._noted = now
        if not self.is_active and now - self._late_since >= PERIOD:
            self.is_active = True
            words = "sessions are woken %.0f ms too late. New ones are refused, and frames are left out"
            log.warning(f"overloaded: {words}", 1000 * late)

    def end_if_over(self, now: float) -> None:
        """End the overload if sessions have been woken in time for a while."""
        if self.is_active and now - self._behind >= RECOVERY:
            self.is_active = False
            log.warning("no longer overloaded: sessions are woken in time")

    def oldest(self, newest: int, now: float, fps: float) -> int:
        """Return the number of the oldest frame that is worth sending.

        Args:
            newest: number of the last frame whose time has come.
            now: seconds on the session clock.
        """
        return newest if self.is_active else first_frame_at(now - OUTDATED, fps)


class Fanout:
    """The distribution of one timeline's frames.

    Attributes:
        members: the subscriptions that get each frame at its time, with their connections.
        ahead: those that get frames ahead.
    """

    def __init__(
        self,
        timeline: FrameTimeline,
        members: list[tuple[Connection, FrameSubscription]],
        overload: Overload,
    ) -> None:
        self._subscriptions = [s for _, s in members]
        timeline.limit_windows(s.stream for s in self._subscriptions)
        self.timeline = timeline
        self._overload = overload
        self.members = [(c, s) for c, s in members if not isinstance(s, AheadSubscription)]
        self.ahead = [(c, s) for c, s in members if isinstance(s, AheadSubscription)]

    @property
    def next(self) -> int:
        """The first frame that a subscriber of `members` has not received."""
        members = self.members
        return members[0][1].next if len(members) == 1 else min(s.next for _, s in members)

    @property
    def next_due(self) -> float:
        """The time of the next message."""
        due = self.next / self.timeline.fps if self.members else math.inf
        for connection, s in self.ahead:
            due = min(due, s.next_due(is_slow=connection.is_slow))
        return due

    def send(self, newest: int, now: float, sends: list[Send]) -> None:
        """Send all frames up to `newest` to the subscribers that have not received them."""
        timeline, first = self.timeline, self.next
        oldest = first if first == newest else self._overload.oldest(newest, now, timeline.fps)
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
        window.drop_source(self._subscriptions)

    def send_ahead(self, newest: int, now: float, sends: list[Send], *, is_reading: bool) -> int:
        """Send what is due to the subscribers that get frames ahead. Return how many must take some back.

        Args:
            newest: number of the last frame whose time has come.
            is_reading: whether the plan will soon change again: what is due at once may wait for that.
        """
        taken_back, version = 0, self.timeline.version
        for connection, s in self.ahead:
            if s.version != version:
                if is_reading and s.can_wait(newest):
                    continue
                taken_back += s.take_back()
            is_slow = connection.is_slow
            if s.next <= newest:
                oldest = self._overload.oldest(newest, now, self.timeline.fps)
                connection.dropped += s.drop_until(newest + 1 if is_slow else oldest)
            if (message := s.message(newest, now, is_slow=is_slow)) is not None:
                sends.append(Send(connection.id, message))
        if (window := self.timeline.latest_window) is not None:
            window.drop_source(self._subscriptions)
        return taken_back


class Broadcast:
    """The streams of one session; each timeline, sound and picture is computed once for all subscribers.

    Attributes:
        counts: counts in `taken_back` how often frames were taken back that had been sent ahead.
        schedule_subscribers: the subscriptions to the stream `schedule`, with their connections.
    """

    def __init__(self, player: Player, faces: CharacterFaces) -> None:
        self.player = player
        self.video = VideoStream(faces)
        self._faces = faces
        # Weak, since subscriptions hold them: the last subscriber takes its timeline with it.
        self._timelines = WeakValueDictionary[tuple[int, float], FrameTimeline]()
        self._audio = WeakValueDictionary[tuple[int | None, int], AudioStream]()
        self._schedules = ScheduleStream(player.blocks)
        self._fanouts: list[Fanout] = []
        self._audio_subscribers: list[tuple[Connection, AudioSubscription]] = []
        self.schedule_subscribers: list[tuple[Connection, ScheduleSubscription]] = []
        self._video_subscribers: list[VideoSubscription] = []
        self.counts = Counter[str]()
        self.overload = Overload()

    def timeline(self, index: int, fps: float) -> FrameTimeline:
        """Return the frames of one character at one rate."""
        timeline = self._timelines.get((index, fps))
        if timeline is None:
            timeline = self._timelines[index, fps] = FrameTimeline(
                self.player, index, fps, lambda: self._faces.of(index), lambda: self._faces.mapping(index)
            )
        return timeline

    def subscribe_audio(self, index: int | None, rate: int, now: float) -> AudioSubscription:
        """Return a subscription to the sound of one character or all from `now` on."""
        sound = self._audio.setdefault((index, rate), AudioStream(self.player, rate, index))
        return AudioSubscription(sound, index or 0, math.ceil((now - EPSILON) / PACKET), self.player.version)

    def subscribe_video(
        self, index: int, fps: float, options: RenderOptions, now: float
    ) -> VideoSubscription:
        """Return a subscription to pictures from `now` on."""
        return self.video.subscription(self.timeline(index, fps), index, options, now)

    def face_changed(self, index: int) -> list[tuple[int, FrameSubscription]]:
        """Use a character's new face from the next frame on.

        Returns:
            Its subscriptions to meshes, each with the id of its connection: they need the new scale.
        """
        for (character, _), timeline in self._timelines.items():
            if character == index:
                timeline.invalidate()
        self.video.face_changed(index)
        members = [member for fanout in self._fanouts for member in fanout.members]
        return [(c.id, s) for c, s in members if s.stream == "mesh" and s.index == index]

    def set_subscribers(self, connections: Iterable[Connection]) -> None:
        """Set the connections whose subscriptions are served."""
        frames: dict[FrameTimeline, list[tuple[Connection, FrameSubscription]]] = {}
        self.schedule_subscribers, self._audio_subscribers, self._video_subscribers = [], [], []
        for connection in connections:
            for s in connection.subscriptions.values():
                if isinstance(s, FrameSubscription):
                    frames.setdefault(s.timeline, []).append((connection, s))
                elif isinstance(s, AudioSubscription):
                    self._audio_subscribers.append((connection, s))
                elif isinstance(s, ScheduleSubscription):
                    self.schedule_subscribers.append((connection, s))
                else:
                    self._video_subscribers.append(s)
        self._fanouts = [Fanout(timeline, members, self.overload) for timeline, members in frames.items()]

    def settle(self, t: float) -> None:
        """Keep the frames before `t` that were sent ahead, since the plan will change at that time."""
        for fanout in self._fanouts:
            for _, s in fanout.ahead:
                s.settle(t)

    def send_due(self, now: float, effects: list[Effect], *, is_reading: bool = False) -> None:
        """Send all that is due to the subscribers of the last `set_subscribers`."""
        self._schedules.send_due(self.schedule_subscribers, now, effects)
        for connection, s in self._audio_subscribers:
            for message, is_sound in s.messages(now):
                if is_sound and connection.is_slow:
                    connection.dropped += 1
                else:
                    effects.append(Send(connection.id, message))
        effects += self.frames_due(now, is_reading=is_reading)
        self.video.due(self._video_subscribers, now, effects)

    def frames_due(self, now: float, *, is_reading: bool = False) -> list[Send]:
        """Return the due frames of the streams of numbers and of mesh.

        Args:
            is_reading: whether the plan will soon change again: frames are taken back after that.
        """
        sends: list[Send] = []
        for fanout in self._fanouts:
            newest = last_frame_at(now, fanout.timeline.fps)
            if fanout.members and fanout.next <= newest:
                fanout.send(newest, now, sends)
            if fanout.ahead:
                taken_back = fanout.send_ahead(newest, now, sends, is_reading=is_reading)
                self.counts["taken_back"] += taken_back
        return sends

    @property
    def next_frame(self) -> float:
        """The time of the next frames; infinity without subscribers."""
        return min([fanout.next_due for fanout in self._fanouts], default=math.inf)

    @property
    def next_other(self) -> float:
        """The time of the next packet, picture or schedule; infinity if there is none."""
        times = [s.next_due() for _, s in self._audio_subscribers]
        times.append(self.video.next(self._video_subscribers))
        times.append(self._schedules.next_due(self.schedule_subscribers))
        return min(times)
