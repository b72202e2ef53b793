"""What a session keeps of one connection: its streams, its place in the feedback log, how far it lags."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from realizer.server.session.effects import RenderOptions
from realizer.server.session.feedback_log import FeedbackFilter
from realizer.server.streams.audio_stream import AudioStream
from realizer.server.streams.frame_windows import FrameTimeline

# Bytes that wait to be sent above which a connection loses frames: two thirds of a second of a mesh.
SLOW = 512 * 1024
# And above which it has stopped reading: it is closed, and can come back with `seen`.
STUCK = 32 * 2**20


@dataclass(eq=False)
class FrameSubscription:
    """fap, au or mesh frames: `next` is the frame to send; `raw`: AUs before the rules of co-occurrence."""

    stream: str
    encoding: str
    timeline: FrameTimeline
    index: int
    name: str | None
    next: int
    raw: bool = False


@dataclass(eq=False)
class AudioSubscription:
    """Sound packets: `next` is the one to send, `sent` the last few that went out."""

    sound: AudioStream
    index: int
    next: int
    version: int
    sent: deque[tuple[int, bytes | None]] = field(default_factory=lambda: deque(maxlen=8))


@dataclass(eq=False)
class VideoView:
    """A picture that is drawn once for everybody who looks at it; `busy` while it is being drawn."""

    timeline: FrameTimeline
    index: int
    face: str
    options: RenderOptions
    next: int
    busy: int | None = None
    drawing: int = 0  # the frame that is being drawn
    started_at: float = 0.0

    @property
    def key(self) -> tuple[object, ...]:
        """What two subscriptions must share to see the same picture."""
        return (self.index, self.timeline.fps, self.face, self.options)


@dataclass(eq=False)
class VideoSubscription:
    """Pictures of a view; `next` is the oldest frame that is still of use, `index` what tells them apart."""

    view: VideoView
    next: int
    index: int


@dataclass(eq=False)
class ScheduleSubscription:
    """What blocks are planned as: `needs_full_update` until it has been sent all of them, `retry_at` when to
    try that."""

    index: int | None  # of the character; None: all
    name: str | None
    needs_full_update: bool = True
    retry_at: float = 0.0


Subscription = FrameSubscription | AudioSubscription | VideoSubscription | ScheduleSubscription


@dataclass(eq=False)
class Connection:
    """One client of a session.

    Attributes:
        next_seq: seq of the next feedback to send.
        feedback: which of it; None for none.
        is_slow: more than SLOW bytes wait to be sent, as the shell told.
        dropped: frames, pictures and sound packets it did not get because it was slow.
        subscriptions: (stream, character, view) -> what it gets.
    """

    id: int
    next_seq: int
    feedback: FeedbackFilter | None = field(default_factory=FeedbackFilter)
    is_slow: bool = False
    dropped: int = 0
    subscriptions: dict[tuple[str, str | None, str | None], Subscription] = field(default_factory=dict)
