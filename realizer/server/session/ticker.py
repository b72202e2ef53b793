"""The ticks of a session: feedback, frames and sound are sent when they are due, documents read in turn."""

import math
from dataclasses import dataclass

from realizer.core import work
from realizer.playback.player import Player
from realizer.server.documents.document_queue import Submission
from realizer.server.session.connections import Connections
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.effects import Effect
from realizer.server.session.session_clock import SessionClock
from realizer.server.streams.broadcast import Broadcast
from realizer.server.streams.frame_windows import EPSILON


@dataclass(eq=False)
class Ticker:
    """Sends what is due, and reads or plans the next document. All times are those of the session's clock."""

    clock: SessionClock
    player: Player
    submission: Submission
    broadcast: Broadcast
    connections: Connections
    controls: ControlHandlers
    must_end_speech: bool = False  # with the next work, as a client has left, or sends no more of a clip
    quiet_until: float = -math.inf  # until then nothing but feedback and frames is due
    # when feedback and frames are due, as of the last `next_time` or `send_ready`
    _next_feedback: float = -math.inf
    _next_frames: float = -math.inf

    def send_ready(self, t: float) -> float | None:
        """Send the due feedback and frames, and return when something is due next; None for `tick`.

        This is the fast way for a session in which nothing else is due.
        """
        if t + EPSILON >= self.quiet_until:
            return None
        if self._next_feedback <= t + EPSILON:
            version = self.player.version
            self.publish(t)
            if self.player.version != version:
                return None
            self._next_feedback = self.player.next_change()
        if self._next_frames <= t + EPSILON:
            self.connections.add_effects(self.broadcast.frames_due(t))
            self._next_frames = self.broadcast.next_frame
        return min(self.quiet_until, self._next_feedback, self._next_frames)

    def tick(self, t: float, read_documents: bool = True, *, starts: bool = False) -> bool:
        """Send due feedback, sound and frames; then, with `read_documents`, read or plan one document.

        Args:
            starts: whether blocks that start at `t` start.

        Returns:
            Whether a document or a speech changed the state.
        """
        self.must_end_speech = bool(self.submission.speeches.overdue(t))
        self.publish(t, starts=starts)
        self.broadcast.set_subscribers(self.connections.values())
        effects: list[Effect] = []
        self.broadcast.send_due(t, effects, is_reading=read_documents and self.submission.has_work)
        self.connections.add_effects(effects)
        if self.submission.pending.blocks:
            self.connections.add_effects(self.submission.tts.expire(t + EPSILON))
        # A tick reads or plans, not both: so the acknowledgement is sent before planning begins, and due
        # frames are sent in between.
        if not read_documents:
            return False
        if self.must_end_speech:
            self.controls.end_overdue_clips(t)
        done = self._read_or_plan(t) or self.must_end_speech
        self.must_end_speech = False
        if self.submission.speeches.advance(t) or done:
            self.publish(t, starts=False)
            return True
        return False

    def _read_or_plan(self, t: float) -> bool:
        """Read or plan one block. The documents of one message are planned for one instant."""
        t = self.clock.present(t)
        if self.submission.pending.first_ready():  # it is planned for this instant
            self.clock.stand_still(t)
        done = self.submission.work(t)
        if not self.submission.is_in_message:
            self.clock.stand_still()
        return done

    @property
    def has_documents(self) -> bool:
        """Whether a document can be read or planned now."""
        return self.must_end_speech or self.submission.has_work

    def next_time(self) -> float:
        """Return the time of the next event other than documents; infinity if there is none."""
        submission, streams = self.submission, self.broadcast
        event, has_work = self.player.next_event, submission.has_work
        self._next_feedback = self.player.next_change()
        if has_work and (start := self.clock.start_of(event)) > event:
            self._next_feedback = start
        other = min(submission.tts.deadline(), streams.next_other)
        has_documents = self.must_end_speech or has_work
        if not has_documents:
            other = min(other, submission.speeches.deadline())
        # Open speeches and slow clients are checked with every frame, schedules with all feedback: then
        # the deadline cannot be kept.
        shown = bool(streams.schedule_subscribers)
        changes = has_documents or self.connections.has_slow or submission.speeches.open_ids or shown
        self.quiet_until = -math.inf if changes else other
        self._next_frames = streams.next_frame
        return min(self._next_feedback, other, self._next_frames)

    def publish(self, t: float, *, starts: bool = True) -> None:
        """Number the feedback that is due and send it to its subscribers.

        Args:
            starts: whether blocks that start at `t` start; not while more may arrive at this instant.
        """
        t = self.clock.present(t)
        if not starts:
            self.clock.hold(t)
        else:
            self.clock.hold()
            if t <= self.player.next_event <= t + EPSILON:
                self.clock.end_instant(self.player.next_event)
        if (change := self.player.next_event) <= t + EPSILON:
            self.broadcast.settle(change)
        texts: list[str] = []
        while due := self.player.due(t + EPSILON, math.inf if starts else t):
            for event in work.counted(due, 20):
                feedback, ending_blocks = self.submission.speeches.process_feedback(event)
                texts.append(self.connections.log.add(feedback, t))
                if ending_blocks:
                    self.submission.end(ending_blocks, t)
        if texts:
            self.connections.send_feedback(texts)

    def send_before_change(self, t: float) -> None:
        """Send due feedback and frames before anything changes, also if the session was woken too late.

        A replay of the journal has no wake-ups in between and must publish the same.
        """
        self.publish(t, starts=False)
        self.connections.add_effects(self.broadcast.frames_due(t, is_reading=True))
