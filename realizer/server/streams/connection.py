"""The state of one connection of a session: its subscriptions and its place in the feedback log."""

from dataclasses import dataclass, field
from typing import NamedTuple

from realizer.server.session.effects import RenderOptions
from realizer.server.session.feedback_log import FeedbackFilter
from realizer.server.streams.audio_stream import AudioSubscription
from realizer.server.streams.frame_windows import FrameSubscription, FrameTimeline

# With more unsent bytes than this a connection misses frames: two thirds of a second of a mesh.
SLOW = 512 * 1024
# With more than this it is closed. The client can resume with `seen`.
STUCK = 32 * 2**20


class Drawing(NamedTuple):
    """A picture that is being drawn: id of its effect `Draw`, number of the frame, and when it was begun."""

    id: int
    frame: int
    begun: float


@dataclass(eq=False)
class VideoView:
    """A view, drawn once for all its subscribers.

    Attributes:
        next: number of the next frame to draw.
        drawing: the picture in progress; None while there is none.
    """

    timeline: FrameTimeline
    index: int
    face: str
    options: RenderOptions
    next: int
    drawing: Drawing | None = None

    @property
    def key(self) -> tuple[object, ...]:
        """The values by which two subscriptions share a view."""
        return (self.index, self.timeline.fps, self.face, self.options)


@dataclass(eq=False)
class VideoSubscription:
    """A subscription to a view: `next` is the oldest useful frame, `index` the low byte of the flags."""

    view: VideoView
    next: int
    index: int


@dataclass(eq=False)
class ScheduleSubscription:
    """A subscription to schedules; with `needs_full_update` all blocks are sent, not before `retry_at`."""

    index: int | None  # of the character; None: all
    name: str | None
    needs_full_update: bool = True
    retry_at: float = 0.0


Subscription = FrameSubscription | AudioSubscription | VideoSubscription | ScheduleSubscription


@dataclass(eq=False)
class Connection:
    """One client of a session.

    Attributes:
        feedback: filter of its feedback; None for no feedback.
        is_slow: whether more than SLOW bytes are unsent.
        dropped: number of frames, pictures and sound packets it missed because it was slow.
        subscriptions: (stream, character, view) -> subscription.
        may_edit: whether it may save files of the service.
    """

    id: int
    feedback: FeedbackFilter | None = field(default_factory=FeedbackFilter)
    is_slow: bool = False
    dropped: int = 0
    subscriptions: dict[tuple[str, str | None, str | None], Subscription] = field(default_factory=dict)
    may_edit: bool = False
