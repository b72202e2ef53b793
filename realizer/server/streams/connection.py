"""The state of one connection of a session: its subscriptions and its place in the feedback log."""

from dataclasses import dataclass, field
from typing import NamedTuple

from bml_schema import parse_feedback
from realizer.server.session.effects import RenderOptions
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
    """A view, drawn once for all its subscribers."""

    timeline: FrameTimeline
    index: int
    face: str
    options: RenderOptions
    next: int  # number of the next frame to draw
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


@dataclass(frozen=True)
class FeedbackFilter:
    """A filter of the feedback for one connection. Messages keep their numbers, so there are gaps.

    Attributes:
        character: id of a character; None accepts all. Feedback without a character is always accepted.
    """

    elements: frozenset[str] | None = None  # names of feedback elements; None accepts all
    character: str | None = None

    def accepts(self, text: str) -> bool:
        """Whether the filter lets a message pass."""
        if self.elements is not None and text[1:].split(maxsplit=1)[0] not in self.elements:
            return False
        return self.character is None or parse_feedback(text).character_id in (None, self.character)


@dataclass(eq=False)
class Connection:
    """One client of a session.

    Attributes:
        feedback: filter of its feedback; None for no feedback.
        subscriptions: (stream, character, view) -> subscription.
    """

    id: int
    feedback: FeedbackFilter | None = field(default_factory=FeedbackFilter)
    is_slow: bool = False  # whether more than SLOW bytes are unsent
    dropped: int = 0  # number of frames, pictures and sound packets it missed because it was slow
    subscriptions: dict[tuple[str, str | None, str | None], Subscription] = field(default_factory=dict)
    may_edit: bool = False
