"""The playout of frames that arrive ahead of their time."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from realizer.protocol.wire import WireFrame

# A consumer that is slower than the frames loses the oldest ones.
MAX_WAITING = 1_000
# The session clock is estimated from the messages of so many seconds.
MEMORY = 5.0  # s


class Playout:
    """A queue of the frames of one stream, each of which is due at its time on the session clock.

    The session clock is estimated from the messages that took the least time: the service sends their last
    frame `ahead` seconds before its time.

    Args:
        ahead: as in `subscribe`.
    """

    def __init__(self, ahead: float) -> None:
        self._ahead = ahead
        self._frames: deque[WireFrame[Any]] = deque(maxlen=MAX_WAITING)
        self._next = 0  # number of the first frame that was not taken
        # (arrival, offset) of messages, the offsets rising: the first is the least of those remembered.
        self._offsets: deque[tuple[float, float]] = deque()

    def receive(self, message: WireFrame[Any], now: float) -> None:
        """Add the frames of a message, instead of those from its first one on.

        Args:
            now: when it arrived, in seconds on any clock that never jumps.
        """
        frames = message.rows()
        while self._frames and self._frames[-1].frame >= message.frame:
            self._frames.pop()
        self._frames.extend(frame for frame in frames if frame.frame >= self._next)
        offset = now - (frames[-1].time - self._ahead)
        while self._offsets and self._offsets[0][0] < now - MEMORY:
            self._offsets.popleft()
        while self._offsets and self._offsets[-1][1] >= offset:
            self._offsets.pop()
        self._offsets.append((now, offset))

    @property
    def next_due(self) -> float:
        """When the next frame is due, on the clock of `receive`; infinity without frames."""
        return self._frames[0].time + self._offsets[0][1] if self._frames else math.inf

    def take(self, now: float) -> WireFrame[Any] | None:
        """Return the next frame if it is due."""
        if self.next_due > now:
            return None
        frame = self._frames.popleft()
        self._next = frame.frame + 1
        return frame
