"""The connections of a session, their subscriptions, and the log of the feedback that is sent to them."""

import zlib
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import NamedTuple

from bml_schema import Feedback, parse_feedback
from realizer.core import work
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.replies import Gap
from realizer.protocol.messages.requests import Subscribe
from realizer.server.session.effects import Close, Effect, RenderOptions, Send
from realizer.server.streams.audio_stream import AudioSubscription
from realizer.server.streams.frame_windows import FrameSubscription, FrameTimeline

FRESH = 60.0  # s; newer messages are kept, unless there are more than MOST
MOST = 10_000  # messages
ROOM = 2**17  # characters of older messages
# Messages are much alike: packs of so many characters are compressed to a ninth.
PACK = 2**14
# A checkpoint contains at most so many messages and characters: some minutes of talk. A client that resumes
# has the rest already, or gets `gap`.
LAST, LAST_TEXT = 1000, 2**19
BETWEEN = "\0"  # not allowed in XML

# With more unsent bytes than this a connection misses frames: two thirds of a second of a mesh.
SLOW = 512 * 1024
# With more than this it is closed. The client can resume with `seen`.
STUCK = 32 * 2**20


class _Pack(NamedTuple):
    """Compressed messages, and the time of the last of them."""

    messages: int
    characters: int
    last_time: float
    data: bytes


class FeedbackLog:
    """The newest messages of a session, numbered by `seq` 1, 2, ...

    A client that resumes within a minute gets all that it missed. Of older messages only some are kept, so
    that the memory of a long session is bounded.

    Args:
        epoch: POSIX seconds at which the session clock was 0; None leaves them out of messages.
    """

    def __init__(self, epoch: float | None = None) -> None:
        self.epoch = epoch
        self.newest = 0  # seq of the last message, 0 before the first
        self._packs: deque[_Pack] = deque()
        self._recent: list[str] = []
        self._unpacked = 0  # characters of `_recent`
        self._count = 0  # stored messages
        self._size = 0  # their characters

    @property
    def first(self) -> int:
        """Seq of the oldest stored message; of the next message if none is stored."""
        return self.newest - self._count + 1

    def add(self, feedback: Feedback, now: float) -> str:
        """Number and store a message, and return its text."""
        self.newest += 1
        text = feedback.to_xml(self.newest, self.epoch)
        self._store(text, now)
        return text

    def restore(self, newest: int, texts: Iterable[str], now: float) -> None:
        """Fill the log with messages, the last of which has the number `newest`."""
        self.newest = newest
        for text in texts:
            self._store(text, now)

    def last(self) -> list[str]:
        """Return the newest messages for a checkpoint, the oldest first."""
        found: list[str] = []
        size = 0
        for text in reversed(self.since(self.newest - LAST + 1)):
            size += len(text)
            if size > LAST_TEXT:
                break
            found.append(text)
        return found[::-1]

    def _store(self, text: str, now: float) -> None:
        self._recent.append(text)
        self._count += 1
        self._size += len(text)
        self._unpacked += len(text)
        if self._unpacked > 2 * PACK:
            self._pack(now)
        packs = self._packs
        while packs and (self._count > MOST or (self._size > ROOM and packs[0].last_time < now - FRESH)):
            self._count -= packs[0].messages
            self._size -= packs.popleft().characters

    def _pack(self, now: float) -> None:
        count = size = 0
        while size < PACK:
            size += len(self._recent[count])
            count += 1
        data = zlib.compress(BETWEEN.join(self._recent[:count]).encode(), 1)
        del self._recent[:count]
        self._packs.append(_Pack(count, size, now, data))
        self._unpacked -= size

    def since(self, seq: int) -> list[str]:
        """Return the stored messages from `seq` on, in order."""
        wanted = min(self.newest - seq + 1, self._count)
        if wanted <= len(self._recent):
            return self._recent[len(self._recent) - wanted :] if wanted > 0 else []
        missing, packs = wanted - len(self._recent), []
        for pack in reversed(self._packs):
            if missing <= 0:
                break
            packs.append(zlib.decompress(pack.data).decode().split(BETWEEN))
            missing -= pack.messages
        return list(chain(*reversed(packs), self._recent))[-wanted:]


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
        requests: the messages that asked for them.
    """

    id: int
    feedback: FeedbackFilter | None = field(default_factory=FeedbackFilter)
    is_slow: bool = False  # whether more than SLOW bytes are unsent
    dropped: int = 0  # number of frames, pictures and sound packets it missed because it was slow
    subscriptions: dict[tuple[str, str | None, str | None], Subscription] = field(default_factory=dict)
    requests: dict[tuple[str, str | None, str | None], Subscribe] = field(default_factory=dict)
    may_edit: bool = False
    sent: int = 0  # seq of the newest feedback that was sent to it, or that its filter held back


class Connections(dict[int, Connection]):
    """The connections of a session, by id."""

    def __init__(self, log: FeedbackLog, add_effects: Callable[[Iterable[Effect]], None]) -> None:
        super().__init__()
        self.log = log
        self.add_effects = add_effects

    def replace(self, others: Mapping[int, Connection]) -> None:
        """Have these connections instead of the present ones."""
        self.clear()
        self.update(others)

    @property
    def has_slow(self) -> bool:
        """Whether one of them is slow."""
        return any(connection.is_slow for connection in self.values())

    def update_backlog(self, id: int, waiting: int) -> bool:
        """Take the number of unsent bytes of a client: a slow one misses frames, a stuck one is closed.

        Returns:
            Whether it is slow.
        """
        if (connection := self.get(id)) is None:
            return False
        connection.is_slow = waiting > SLOW
        if waiting > STUCK:
            reason = f"{waiting} bytes wait to be read; reconnect with the session's name and seen"
            self.add_effects([Close(id, 1013, reason)])
        return connection.is_slow

    def reply(self, id: int, reply: Reply) -> None:
        """Send a message to a connection that has not left."""
        if id in self:
            self.add_effects([Send(id, reply.text())])

    def send_feedback(self, texts: list[str]) -> None:
        """Send feedback to all that want it."""
        for connection in self.values():
            self._send_feedback(connection, texts)

    def send_unsent_feedback(self) -> None:
        """Send the feedback that was numbered, and could not be sent."""
        for connection in self.values():
            self._send_feedback(connection, self.log.since(connection.sent + 1))

    def send_missed_feedback(self, id: int, seen: int) -> None:
        """Send the feedback after `seen`, and `gap` first if some of it is not stored or never existed."""
        first = self.log.first
        if seen + 1 < first or seen > self.log.newest:
            self.reply(id, Gap(seen=seen, first=first))
            seen = first - 1
        self._send_feedback(self[id], self.log.since(seen + 1))

    def _send_feedback(self, connection: Connection, texts: list[str]) -> None:
        connection.sent = self.log.newest
        if (filter := connection.feedback) is not None:
            self.add_effects(
                [Send(connection.id, text) for text in work.counted(texts) if filter.accepts(text)]
            )
