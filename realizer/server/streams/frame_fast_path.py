"""A strip of frames that one client gets while nothing else is due in, each at its time out."""

from __future__ import annotations

from realizer.server.streams.connection import FrameSubscription
from realizer.server.streams.frame_windows import EPSILON, Strip


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
