"""The deadlines of a session: when it must be woken."""

from __future__ import annotations

import math

from realizer.playback.player import Player
from realizer.server.documents.document_queue import Submission
from realizer.server.session.connections import Connections
from realizer.server.session.session_clock import SessionClock
from realizer.server.streams.broadcast import Broadcast
from realizer.server.streams.frame_windows import EPSILON


class Deadlines:
    """When a session is next due, in seconds on its clock; what is known is kept until something changes."""

    def __init__(
        self,
        clock: SessionClock,
        player: Player,
        submission: Submission,
        broadcast: Broadcast,
        connections: Connections,
    ) -> None:
        self._clock = clock
        self._player = player
        self._submission = submission
        self._streams = broadcast
        self._connections = connections
        self._feedback = 0.0
        self._other: float | None = None  # of the next event that is neither a frame nor feedback

    def forget(self) -> None:
        """Find the deadlines anew when they are wanted next."""
        self._other = None

    @property
    def is_known(self) -> bool:
        """Whether nothing but frames and feedback is due at once."""
        return self._other is not None

    @property
    def next_event(self) -> float:
        """The time of the next event that is no frame, if it is known."""
        assert self._other is not None
        return min(self._other, self._feedback)

    def has_only_frames_and_feedback(self, t: float) -> bool:
        """Return whether at most frames and feedback are due at a time, as far as is known."""
        return self._other is not None and t + EPSILON < self._other

    def has_feedback(self, t: float) -> bool:
        """Return whether feedback is due at a time, as far as is known."""
        return t + EPSILON >= self._feedback

    def update_feedback(self) -> None:
        """Find the next deadline of feedback."""
        self._feedback = self._player.next_change()

    def next(self, *, has_documents: bool) -> float:
        """Return the time of the next event other than documents; infinity if there is none.

        Args:
            has_documents: whether a document can be read or planned now.
        """
        other, streams = self._other, self._streams
        if other is None:
            self.update_feedback()
            answer_due, event = self._submission.tts.deadline(), self._player.next_event
            if self._submission.has_work and (start := self._clock.start_of(event)) > event:
                self._feedback = start
            other = streams.next_other if streams.active else math.inf
            other = min(other, math.inf if answer_due is None else answer_due)
            if not has_documents:
                other = min(other, self._submission.speeches.deadline())
            # Open speeches and slow clients are checked with every frame, schedules with all feedback: then
            # the deadline cannot be kept.
            shown = streams.active and bool(streams.schedule_subscribers)
            if not (
                has_documents or self._connections.has_slow or self._submission.speeches.open_ids or shown
            ):
                self._other = other
        return min(other, self._feedback, streams.next_frame if streams.active else math.inf)
