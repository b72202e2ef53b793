"""The time at which a session must be woken next."""

from __future__ import annotations

import math
from collections.abc import Mapping

from realizer.playback.player import Player
from realizer.server.documents.document_queue import Submission
from realizer.server.streams.broadcast import Broadcast, FrameRun
from realizer.server.streams.connection import Connection
from realizer.server.streams.frame_windows import EPSILON


class WakeupPlan:
    """The cached deadlines of a session, in seconds on its clock.

    Args:
        connections: the session's own dictionary of connections, which changes.

    Attributes:
        fast_path: the frames of the only client, which need no call of the session; None if more is due.
        unsettled: whether a client has left, whose open speeches must be ended now.
    """

    def __init__(
        self,
        player: Player,
        submission: Submission,
        broadcast: Broadcast,
        connections: Mapping[int, Connection],
    ) -> None:
        self.fast_path: FrameRun | None = None
        self.unsettled = False
        self._player = player
        self._submission = submission
        self._broadcast = broadcast
        self._connections = connections
        # Time of the next event that is neither a frame nor feedback; None if unknown.
        self._next_other: float | None = None
        self._next_feedback = 0.0

    def invalidate(self) -> None:
        """Forget the cached deadline; `next` computes it again."""
        self._next_other = self.fast_path = None

    def only_frames_due(self, t: float) -> bool:
        """Whether nothing but frames and feedback can be due at `t`."""
        return self._next_other is not None and t + EPSILON < self._next_other

    def feedback_due(self, t: float) -> bool:
        """Whether feedback is due at `t`."""
        return t + EPSILON >= self._next_feedback

    def feedback_sent(self, plans: int) -> None:
        """Note that feedback was published; `plans` is the player's version before that."""
        self._next_feedback = self._player.next_change()
        if self._player.version != plans:
            self.invalidate()

    @property
    def has_documents(self) -> bool:
        """Whether a document can be read or planned now."""
        return self._next_other is None and (self.unsettled or self._submission.has_work)

    def next(self) -> float:
        """Return the time of the next event other than documents; infinity if there is none."""
        other, streams = self._next_other, self._broadcast
        if other is None:
            self._next_feedback, asked = self._player.next_change(), self._submission.tts.deadline()
            other = streams.next_other if streams.active else math.inf
            other = other if asked is None else min(other, asked)
            # Open speeches and slow clients are checked with every frame, schedules with all feedback: then
            # the deadline cannot be cached.
            slow = any(connection.is_slow for connection in self._connections.values())
            shown = streams.active and streams.has_schedule_subscribers
            if not (self.has_documents or slow or self._submission.speeches.has_open or shown):
                self._next_other = other
        return min(other, self._next_feedback, streams.next_frame if streams.active else math.inf)

    def next_after_frames(self, following: float, opened: float) -> float:
        """Return the same as `next` after frames were sent, and renew `fast_path`.

        Args:
            following: time of the next frame.
            opened: the caller's clock when the session clock was 0.
        """
        if self._next_other is None:
            return self.next()
        other = min(self._next_other, self._next_feedback)
        self.fast_path = self._broadcast.fast_path(opened, other + opened)
        return min(other, following)
