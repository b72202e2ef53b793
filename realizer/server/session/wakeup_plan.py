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
    """Times are seconds on the session clock.

    Args:
        connections: who shares the session, as it goes on.

    Attributes:
        fast_path: the frames of its only client for which nobody need ask it; None where there is more to it.
        unsettled: who has left may have left speeches, which end now: nothing else says when.
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
        # Until then nothing is due but frames and what blocks tell as they play; None where that is not
        # known. And when they tell something.
        self._next_other: float | None = None
        self._next_feedback = 0.0

    def invalidate(self) -> None:
        """Something may change: nobody knows what is due before all of it has been looked at."""
        self._next_other = self.fast_path = None

    def only_frames_due(self, t: float) -> bool:
        """Nothing is due but frames and feedback."""
        return self._next_other is not None and t + EPSILON < self._next_other

    def feedback_due(self, t: float) -> bool:
        """Feedback is due."""
        return t + EPSILON >= self._next_feedback

    def feedback_sent(self, plans: int) -> None:
        """Feedback has been told; `plans`: the player's revision before."""
        self._next_feedback = self._player.next_change()
        if self._player.version != plans:
            self.invalidate()

    @property
    def has_documents(self) -> bool:
        """A document can be read or planned at once."""
        return self._next_other is None and (self.unsettled or self._submission.has_work)

    def next(self) -> float:
        """When something is due that is no document; infinite where nothing is."""
        other, streams = self._next_other, self._broadcast
        if other is None:
            self._next_feedback, asked = self._player.next_change(), self._submission.tts.deadline()
            other = streams.next_other if streams.active else math.inf
            other = other if asked is None else min(other, asked)
            # Speeches that last and clients that are slow are looked at with every frame, plans with whatever
            # is told.
            slow = any(connection.is_slow for connection in self._connections.values())
            shown = streams.active and streams.has_schedule_subscribers
            if not (self.has_documents or slow or self._submission.speeches.has_open or shown):
                self._next_other = other
        return min(other, self._next_feedback, streams.next_frame if streams.active else math.inf)

    def next_after_frames(self, following: float, opened: float) -> float:
        """As `next`, when frames have been sent; those that follow need nobody to ask for them, if they can.

        Args:
            following: when the next frame is due.
            opened: when the session's clock was 0, on the caller's clock.
        """
        if self._next_other is None:
            return self.next()
        other = min(self._next_other, self._next_feedback)
        self.fast_path = self._broadcast.fast_path(opened, other + opened)
        return min(other, following)
