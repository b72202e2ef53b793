"""Subscriptions whose rows are sent ahead of their time, and taken back when the plan changes."""

import math
from dataclasses import dataclass, field

from realizer.server.streams.frame_windows import (
    EPSILON,
    FrameSubscription,
    FrameWindow,
    first_frame_at,
    last_frame_at,
)

# Rows that are together shorter than this share of `ahead` are sent in one message. So the first of them is
# sent more than half of `ahead` before its time, also if the session is woken a little too late.
SHARE = 0.4


@dataclass(eq=False)
class AheadSubscription(FrameSubscription):
    """A subscription to a stream of numbers that gets several rows in a message, up to `ahead` seconds early.

    Attributes:
        final: number of the first row that can still be taken back: those before it were shown.
    """

    final: int = field(init=False)
    version: int = -1  # version of the timeline from which the rows `final` .. `next - 1` were computed.
    takes_back: bool = False  # whether rows were taken back since the last message
    _due: float = -math.inf  # when the next message is due, if the plan does not change
    _window: FrameWindow | None = None  # has the rows `final` .. `next - 1`

    def __post_init__(self) -> None:
        self.final = self.next

    def next_due(self, *, is_slow: bool) -> float:
        """Return when `message` is due; negative infinity for now, since the plan has changed.

        Args:
            is_slow: whether the client is slow: then it loses each row at the row's time.
        """
        if self._is_outdated:
            return -math.inf
        return self.next / self.timeline.fps if is_slow else self._due

    def settle(self, t: float) -> None:
        """Keep the rows before `t`, since the plan will change at that time."""
        if not self._is_outdated:
            self.final = max(self.final, first_frame_at(t, self.timeline.fps))

    def can_wait(self, newest: int) -> bool:
        """Whether nothing is lost if changes of the plan are handled later: no row is due after `newest`."""
        return self._is_outdated and self.final > newest

    def take_back(self) -> bool:
        """Return to the first row that was sent and has changed. Return whether there is one."""
        changed = None
        if self._is_outdated:
            assert self._window is not None
            window = self.timeline.window(self.final, self.next - 1)
            before, after = (w.rows(self, self.final, self.next) for w in (self._window, window))
            differs = (before != after).any(axis=1)
            if differs.any():
                changed = self.next = self.final + int(differs.argmax())
                self.takes_back = True
            self._window = window
        self.version = self.timeline.version
        return changed is not None

    def drop_until(self, oldest: int) -> int:
        """Skip the rows before `oldest`. Return their number."""
        dropped = max(0, oldest - self.next)
        self.next += dropped
        return dropped

    def message(self, newest: int, now: float, *, is_slow: bool) -> str | bytes | None:
        """Return a message with the rows up to `now + ahead`; None if it is not due, or the client slow.

        Args:
            newest: number of the last row whose time has come.
        """
        message, fps = None, self.timeline.fps
        if (self.takes_back or self._due <= now + EPSILON) and not is_slow:
            last = last_frame_at(now + self.ahead, fps)
            if self.next <= last:
                self._window = self.timeline.window(min(self.final, self.next), last)
                message = self._window.rows_message(self, self.next, last, flush=self.takes_back)
                self.next, self.takes_back = last + 1, False
            together = math.floor(SHARE * self.ahead * fps + EPSILON)
            self._due = (self.next + together) / fps - self.ahead
        self.final = max(self.final, newest + 1)
        return message

    @property
    def _is_outdated(self) -> bool:
        """Whether rows may be wrong that were sent and not shown."""
        return self.version != self.timeline.version and self.final < self.next and self._window is not None
