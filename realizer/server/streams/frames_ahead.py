"""Subscriptions whose rows are sent ahead of their time, and taken back when the plan changes."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
# Frames that are later than this, after the process stalled, are not sent.
LATE = 0.5  # s


@dataclass(eq=False)
class AheadSubscription(FrameSubscription):
    """A subscription to fap, au or arkit that gets several rows in a message, up to `ahead` seconds early.

    Attributes:
        final: number of the first row that can still be taken back: those before it were shown.
        version: version of the timeline from which the rows `final` .. `next - 1` were computed.
        takes_back: whether rows were taken back since the last message.
    """

    final: int = 0
    version: int = -1
    takes_back: bool = False
    _window: FrameWindow | None = None  # has the rows `final` .. `next - 1`

    def next_due(self, *, is_slow: bool) -> float:
        """Return when `message` is due; negative infinity for now, since the plan has changed.

        Args:
            is_slow: whether the client is slow: then it loses each row at the row's time.
        """
        if self._is_outdated:
            return -math.inf
        fps = self.timeline.fps
        if is_slow:
            return self.next / fps
        together = math.floor(SHARE * self.ahead * fps + EPSILON)
        return (self.next + together) / fps - self.ahead

    def settle(self, t: float) -> None:
        """Keep the rows before `t`, since the plan will change at that time."""
        if not self._is_outdated:
            self.final = max(self.final, first_frame_at(t, self.timeline.fps))

    def must_wait(self, now: float) -> bool:
        """Whether nothing is lost if changes of the plan are handled later: no row is due."""
        return self._is_outdated and self.final > last_frame_at(now, self.timeline.fps)

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

    def drop_late(self, now: float, *, is_slow: bool) -> int:
        """Skip rows that are too late, for a slow client all whose time has come. Return their number."""
        fps = self.timeline.fps
        oldest = last_frame_at(now, fps) + 1 if is_slow else first_frame_at(now - LATE, fps)
        dropped = max(0, oldest - self.next)
        self.next += dropped
        return dropped

    def message(self, now: float, *, is_slow: bool) -> str | bytes | None:
        """Return a message with the rows up to `now + ahead`; None if it is not due, or the client slow."""
        fps = self.timeline.fps
        passed, last = last_frame_at(now, fps), last_frame_at(now + self.ahead, fps)
        message = None
        is_due = self.takes_back or self.next_due(is_slow=False) <= now + EPSILON
        if is_due and self.next <= last and not is_slow:
            window = self._window = self.timeline.window(min(self.final, self.next), last)
            message = window.rows_message(self, self.next, last, flush=self.takes_back)
            self.next, self.takes_back = last + 1, False
        self.final = max(self.final, passed + 1)
        return message

    @property
    def _is_outdated(self) -> bool:
        """Whether rows may be wrong that were sent and not shown."""
        return self.version != self.timeline.version and self.final < self.next and self._window is not None
