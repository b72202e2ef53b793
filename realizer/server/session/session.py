"""A session: it takes documents, control messages and the time, and returns effects.

It opens no sockets and reads no clock.
"""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from bml_schema import WarningFeedback
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import KINDS
from realizer.core import work
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.protocol.messages.common import PROTOCOL, Reply
from realizer.protocol.messages.parse import Control, parse_control
from realizer.protocol.messages.replies import (
    BlockState,
    CharacterState,
    ErrorMessage,
    Gap,
    Pong,
    StateMessage,
    VoiceState,
)
from realizer.protocol.messages.requests import Hello, Ping, StateQuery, Subscribe, Unsubscribe
from realizer.protocol.wire import WireError, unpack_clip
from realizer.server.documents.document_queue import Submission, block_id_of
from realizer.server.documents.limits import duration_error
from realizer.server.journal import JournalError, TakenOver
from realizer.server.journal.checkpoint import Checkpoint
from realizer.server.journal.entry import Kind
from realizer.server.journal.journal_writer import JournalWriter
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.control_fields import FieldError
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.effects import Close, Effect, MoveConnection, Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.session_clock import SessionClock
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.session.welcome import build_welcome
from realizer.server.speech.audio_clips import HEARD, AudioClips
from realizer.server.streams.broadcast import Broadcast, FrameRun
from realizer.server.streams.connection import SLOW, STUCK, Connection
from realizer.server.streams.frame_windows import EPSILON
from realizer.server.streams.frames_ahead import AheadRun
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)

# Messages that affect only their own connection: they are not written to the journal.
PASSING = (Hello, Ping, StateQuery, Subscribe, Unsubscribe)


class Session:
    """A clock, characters, blocks, a scene and a feedback log, and the connections that share them.

    The host calls `receive`, `on_speech`, `on_picture` and `tick`, and carries out `take_effects` after each
    call. It calls `tick` at `next_due`, and immediately while the session `has_documents`. Parameters `now`
    are seconds on the host's clock, `t` seconds on the session clock.

    Args:
        id: the session's name.
        settings: limits and defaults.
        now: the session clock starts here. If the host's clock goes back, the session clock waits.
        named: whether a client chose the name: then the session outlives its last connection by
            `settings.keep`.
        scene: the initial positions of targets.
        capabilities: of the service, for `welcome`.
        epoch: POSIX seconds at `now`, added to every time in feedback; None leaves them out.
        log: the feedback log of another session, to continue it.

    Attributes:
        clock: the session clock.
        ending: whether documents are refused because the service is ending.
        feedback_log: the published feedback.
        fast_path: the frames of the only client, which need no call of the session; None if more is due.
    """

    def __init__(
        self,
        id: str,
        settings: Settings,
        now: float,
        *,
        named: bool = False,
        scene: Mapping[str, Position] | None = None,
        capabilities: Mapping[str, Any] | None = None,
        epoch: float | None = None,
        log: FeedbackLog | None = None,
    ) -> None:
        self.id = id
        self.settings = settings
        self.clock = SessionClock(now)
        self.named = named
        self.closed = False
        self.ending = False
        self.empty_since: float | None = now
        self.journal = JournalWriter(id)
        self.faces = CharacterFaces(settings)
        self.clips = AudioClips()
        self.player = Player(
            settings.play_options(scene),
            kinds=KINDS,
            clips=self.clips.recordings,
            face_inputs=lambda index: self.faces.of(index).inputs,
            veto=lambda block, schedule: duration_error(block, schedule, settings),
        )
        self.capabilities = dict(capabilities or {})
        self.broadcast = Broadcast(self.player, self.faces)
        self.submission = Submission(id, settings, self.player, self.clock, self._add_effects)
        self._connections: dict[int, Connection] = {}
        self.feedback_log = log or FeedbackLog(epoch)
        self._checkpoint = Checkpoint(self.player, self.faces, self.clips, self.submission, self.feedback_log)
        self.fast_path: FrameRun | AheadRun | None = None
        self._effects: list[Effect] = []
        # The cached deadlines on the session clock: of the next event that is neither a frame nor feedback
        # (None if unknown), and of feedback.
        self._next_other: float | None = None
        self._next_feedback = 0.0
        self._client_left = False  # its open speeches end with the next tick
        self.subscriptions = Subscriptions(
            settings, self.player, self.faces, self.broadcast, self._connections, self.reply
        )
        self._controls = ControlHandlers(
            self.player, self.faces, self.clips, self.submission, self.subscriptions, self.reply
        )

    # connections --------------------------------------------------------------------------------

    @property
    def connections(self) -> tuple[int, ...]:
        """The ids of the connections that share the session."""
        return tuple(self._connections)

    def connect(self, connection: int, now: float, seen: int | None = None) -> None:
        """Add a connection. With `seen` it gets all feedback after that one, without it only new feedback."""
        if self.closed:  # it ended while the client waited for it
            self._effects.append(Close(connection, 1012, f"session {self.id} has ended: reconnect"))
            return
        self._forget_deadline()
        self._connections[connection] = Connection(connection)
        if not self.log_entry(self.clock.read(now), "join", connection):
            return
        self.empty_since = None
        if seen is not None:
            self.send_missed_feedback(connection, seen)

    def disconnect(self, connection: int, now: float, *, is_awaited: bool = False) -> None:
        """Remove a connection. An unnamed session closes with its last connection.

        Args:
            is_awaited: whether other clients will connect at once: then it stays open.
        """
        if self._connections.pop(connection, None) is not None:
            self.log_entry(self.clock.read(now), "leave", connection)
        self.submission.speeches.on_disconnect(connection)
        self._client_left = True
        self._forget_deadline()
        if not self._connections:
            self.empty_since = now
            if not self.named and not is_awaited:
                self.close()

    def dropped_count(self, connection: int) -> int:
        """Return how many frames, pictures and packets a client missed because it was slow."""
        return c.dropped if (c := self._connections.get(connection)) else 0

    def is_expired(self, now: float) -> bool:
        """Whether the session has had no connection for `settings.keep` seconds."""
        return self.empty_since is not None and now >= self.empty_since + self.settings.keep

    def close(self) -> None:
        """Close the session: it does and sends nothing any more."""
        self.closed = True
        self._forget_deadline()
        self._connections.clear()
        self.submission.queue.clear()
        self._effects.clear()

    def update_backlog(self, connection: int, waiting: int) -> None:
        """Take the number of unsent bytes of a client: a slow one misses frames, a stuck one is closed."""
        if (client := self._connections.get(connection)) is None:
            return
        client.is_slow = waiting > SLOW
        if client.is_slow:
            self._forget_deadline()
        if waiting > STUCK:
            reason = f"{waiting} bytes wait to be read; reconnect with the session's name and seen"
            self._effects.append(Close(connection, 1013, reason))

    # messages in --------------------------------------------------------------------------------

    def receive(self, connection: int, message: str | bytes, now: float) -> None:
        """Handle a message: bytes are a sound clip, text that starts with `{` is control, all else is BML."""
        if self.closed or connection not in self._connections:
            return
        t = self.clock.read(now)
        self._send_due(t)
        if self.journal.needs_checkpoint and not self._compact(t):
            return
        in_journal = self._dispatch(self._connections[connection], message, t)
        if not self.closed and self._work(t) and not in_journal:
            self.log_entry(t, "tick")

    def _dispatch(self, connection: Connection, message: str | bytes, t: float) -> bool:
        """Handle a message, or reply with an error. Return whether it was written to the journal."""
        control: Control | None = None
        if isinstance(message, str) and (text := message.lstrip("\ufeff \t\r\n")).startswith("{"):
            parsed = parse_control(text)
            if isinstance(parsed, ErrorMessage):
                self.reply(connection.id, parsed)
                return False
            if isinstance(parsed, PASSING):
                self._handle_passing(connection, parsed, t)
                return False
            control = parsed
        is_bml = control is None and isinstance(message, str)
        ending = "the service is ending and takes no more documents" if self.ending and is_bml else None
        kind: Kind = "text" if isinstance(message, str) else "sound"
        if (refused := ending or self._write_journal(t, kind, connection, message)) is not None:
            if is_bml:
                # Without a number: the message is not in the journal, and a session that is restored from the
                # journal must number all other feedback in the same way.
                id = block_id_of(str(message))
                warning = WarningFeedback(id=id, type="CANNOT_CREATE_BEHAVIOR", text=refused)
                for client in self._connections.values():
                    self._send_feedback(client, [warning.to_xml()])
            else:
                self.reply(connection.id, ErrorMessage(code="journal", message=refused))
        elif isinstance(message, bytes):
            self._add_sound(connection, message, t)
        elif control is not None:
            self._handle(connection, control, t)
        else:
            self.submission.enqueue(message)
        return refused is None

    def _add_sound(self, connection: Connection, message: bytes, t: float) -> None:
        try:
            piece = unpack_clip(message)
            if piece.id.startswith(HEARD):
                self._controls.hear(piece, t)
            else:
                self.clips.add_chunk(piece)
        except WireError as error:
            self.reply(connection.id, ErrorMessage(code="unsupported", message=str(error)))
        except FieldError as error:
            self.reply(connection.id, ErrorMessage(code="clip", message=str(error), where=error.where))

    def _handle_passing(self, connection: Connection, control: Control, t: float) -> None:
        """Handle a message that is not written to the journal, except for the characters that it adds."""
        known = self.player.characters
        self._handle(connection, control, t)
        for name in self.player.characters:
            if name not in known:  # their order matters: the first is the default
                self.log_entry(t, "text", connection.id, json.dumps({"type": "character", "id": name}))

    def _handle(self, connection: Connection, control: Control, t: float) -> None:
        match control:
            case Hello():
                self._hello(connection, control, t)
            case StateQuery():
                self.reply(connection.id, self._state(connection, t))
            case Ping():
                self.reply(connection.id, Pong(id=control.id, time=t))
            case _:
                self._controls.handle(connection, control, t)

    def _hello(self, connection: Connection, message: Hello, t: float) -> None:
        if message.version != PROTOCOL:
            text = f"wanted version {PROTOCOL} of the protocol, got {message.version}"
            self.reply(connection.id, ErrorMessage(code="version", message=text, where="hello.version"))
        elif message.session not in (None, self.id):
            assert message.session is not None
            self._effects.append(MoveConnection(connection.id, message.session, message.seen))
        else:
            self.send_welcome(connection.id, t)
            if message.seen is not None:
                self.send_missed_feedback(connection.id, message.seen)

    def _state(self, connection: Connection, t: float) -> StateMessage:
        state = self.player.state(t)
        preparing = [
            BlockState(id=w.block.id, character=w.block.character_id, status="IN_PREP")
            for w in self.submission.pending.blocks
        ]
        characters = [
            CharacterState(face=self.faces.name(index), voice=self.submission.voices.get(index), **face)
            for index, face in enumerate(state["characters"])
        ]
        return StateMessage(
            session=self.id,
            time=t,
            blocks=[*(BlockState(**block) for block in state["blocks"]), *preparing],
            characters=characters,
            voice=VoiceState(name=self.settings.voice, fault=self.submission.tts.fault),
            connections=len(self._connections),
            dropped=connection.dropped,
        )

    # journal ------------------------------------------------------------------------------------

    def _write_journal(
        self, t: float, kind: Kind, connection: Connection, message: str | bytes
    ) -> str | None:
        """Write a message to the journal. Return why it cannot be accepted, or None."""
        try:
            self.journal.append(t, kind, connection.id, message)
        except TakenOver as error:
            self.hand_over(error)
            return str(error)
        except JournalError as error:
            log.error("session %s: %s", self.id, error)
            return f"this could not be written to the journal, so it is refused: {error}"
        return None

    def log_entry(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write an event to the journal. Return False if another process has taken over the session."""
        try:
            self.journal.try_append(t, kind, number, body)
        except TakenOver as error:
            self.hand_over(error)
            return False
        return True

    def _compact(self, t: float) -> bool:
        """Replace the journal by a checkpoint if nothing plays. All feedback due by `t` was published.

        Return False if another process has taken over the session. Normally the face must be at rest too. If
        the journal is far too long, this is not required: then a blink or a nod of the next seconds, which
        depends on the last speech, may differ after a takeover.
        """
        if not (
            self.submission.is_idle
            and self.player.is_idle(t if self.journal.is_far_too_long else float("-inf"))
        ):
            return True
        try:
            if self.journal.compact(self._checkpoint.write(t, self.connections)):
                self.clips.settle()
        except TakenOver as error:
            self.hand_over(error)
            return False
        return True

    def restore(self, parts: Mapping[str, str]) -> float:
        """Restore the state and the connections of a checkpoint. The session must be new and opened at 0.

        Args:
            parts: the parts of the checkpoint, as in `SavedSession`.

        Returns:
            The time of the checkpoint on the session clock.

        Raises:
            JournalError: the parts are invalid, or of another version.
        """
        at, connections = self._checkpoint.read(self.id, parts)
        for connection in connections:
            self.connect(connection, at)
        return at

    def hand_over(self, error: TakenOver) -> None:
        """Close all connections because another process has taken over; clients reconnect there."""
        log.warning("%s", error)
        closing: list[Effect] = [Close(connection, 1012, str(error)) for connection in self._connections]
        self.close()
        self._effects = closing

    def on_speech(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """Take the answer to an effect `Speak`. If the voice failed, the silent voice replaces it."""
        if self.closed:
            return
        t = self.clock.read(now)
        self._send_due(t)
        if self.log_entry(t, "spoken", speak, "" if isinstance(result, Utterance) else str(result)):
            self._effects += self.submission.tts.answer(speak, result, t)
            self._work(t)

    def on_picture(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """Take the answer to an effect `Draw`. If it is an error, the subscriptions to the picture end."""
        if self.closed:
            return
        self._forget_deadline()
        picture = result if isinstance(result, bytes) else None
        effects, viewers = self.broadcast.video.on_picture(draw, picture, self._connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            for connection in viewers:
                for key in [k for k in connection.subscriptions if k[0] == "video"]:
                    del connection.subscriptions[key]
                self.reply(connection.id, ErrorMessage(code="render", message=str(result), where="video"))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float, *, read_documents: bool = True) -> None:
        """Send due feedback, sound and frames; then, with `read_documents`, read or plan one document."""
        t = self.clock.read(now)
        starts = not self.submission.has_work
        if not self.closed and self._work(t, read_documents, starts=starts):
            self.log_entry(t, "tick")

    def frames(self, now: float) -> tuple[list[Effect], float] | None:
        """Return due frames and feedback, and the next deadline; None if `tick` must be called instead.

        This is the fast way for a session in which nothing but frames and feedback is due.
        """
        t = now - self.clock.opened
        if self._next_other is None or t + EPSILON >= self._next_other:
            return None
        if t + EPSILON >= self._next_feedback:
            version = self.player.version
            self._publish(t)
            self._next_feedback = self.player.next_change()
            if self.player.version != version:
                self._forget_deadline()
        sends, following = self.broadcast.frames_due(t)
        effects = [*self.take_effects(), *sends]
        if self._next_other is None:
            return effects, self.next_due()
        opened = self.clock.opened
        other = min(self._next_other, self._next_feedback) + opened
        self.fast_path = self.broadcast.fast_path(opened, other)
        return effects, min(other, following + opened)

    def compact_journal(self, now: float) -> None:
        """Replace the journal by a checkpoint if it has grown; due feedback is published first."""
        if self.journal.needs_checkpoint and not self.closed:
            self._forget_deadline()
            self._publish(t := self.clock.read(now))
            self._compact(t)

    def replay_until(
        self, t: float, before: Callable[[float], None] = lambda t: None, *, since: float = 0.0
    ) -> None:
        """Publish the feedback that is due before `t`, each at its own time, for a replay.

        Args:
            before: called with each of those times, before the feedback is published.
            since: the time of feedback that is due immediately.
        """
        while (due := self.player.next_deadline()) is not None and due < t and not self.closed:
            due = max(due, since)
            if self.clock.stands_still(due):
                return  # it was published when the documents of a message had been planned
            before(due)
            self._publish(due)

    def _work(self, t: float, read_documents: bool = True, *, starts: bool = False) -> bool:
        """Do the work of `tick`. Return whether a document or a speech changed the state.

        Args:
            starts: whether blocks that start at `t` start.
        """
        self._client_left = False
        self._forget_deadline()
        self._publish(t, starts=starts)
        if self.broadcast.active or any(c.subscriptions for c in self._connections.values()):
            self.broadcast.set_subscribers(self._connections.values())
            self.broadcast.send_due(t, self._effects, is_reading=read_documents and self.submission.has_work)
        if self.submission.pending.blocks:
            self._effects += self.submission.tts.expire(t + EPSILON)
        # A tick reads or plans, not both: so the acknowledgement is sent before planning begins, and due
        # frames are sent in between.
        if not read_documents:
            return False
        done = self.submission.work(t)
        if self.submission.speeches.advance(t) or done:
            self._publish(t, starts=False)
            return True
        return False

    @property
    def has_documents(self) -> bool:
        """Whether a document can be read or planned now."""
        if self.closed or self._next_other is not None:
            return False
        return self._client_left or self.submission.has_work

    def next_due(self) -> float:
        """Return the time of the next event other than documents; infinity if there is none."""
        if self.closed:
            return math.inf
        other, streams = self._next_other, self.broadcast
        if other is None:
            self._next_feedback, answer_due = self.player.next_change(), self.submission.tts.deadline()
            event = self.player.next_event
            if self.submission.has_work and (start := self.clock.start_of(event)) > event:
                self._next_feedback = start
            other = streams.next_other if streams.active else math.inf
            other = other if answer_due is None else min(other, answer_due)
            # Open speeches and slow clients are checked with every frame, schedules with all feedback: then
            # the deadline cannot be cached.
            slow = any(connection.is_slow for connection in self._connections.values())
            shown = streams.active and bool(streams.schedule_subscribers)
            if not (self.has_documents or slow or self.submission.speeches.open_ids or shown):
                self._next_other = other
        next_frame = streams.next_frame if streams.active else math.inf
        return min(other, self._next_feedback, next_frame) + self.clock.opened

    def _forget_deadline(self) -> None:
        self._next_other = self.fast_path = None

    @property
    def busy(self) -> bool:
        """Whether a block plays, waits or is being prepared."""
        return bool(
            self.submission.queue or len(self.submission.pending) or self.player.next_deadline() is not None
        )

    def _add_effects(self, effects: Iterable[Effect]) -> None:
        self._effects += effects

    def take_effects(self) -> list[Effect]:
        """Return the effects since the last call, in order."""
        effects, self._effects = self._effects, []
        return effects

    # feedback -----------------------------------------------------------------------------------

    def _publish(self, t: float, *, starts: bool = True) -> None:
        """Number the feedback that is due and send it to its subscribers.

        Args:
            starts: whether blocks that start at `t` start; not while more may arrive at this instant.
        """
        t = self.clock.present(t)
        if not starts:
            self.clock.hold(t)
        else:
            self.clock.release()
            if t <= self.player.next_event <= t + EPSILON:
                self.clock.end_instant(self.player.next_event)
        if self.broadcast.active and (change := self.player.next_event) <= t + EPSILON:
            self.broadcast.settle(change)
        texts: list[str] = []
        while due := self.player.due(t + EPSILON, math.inf if starts else t):
            for event in work.counted(due, 20):
                feedback, ending_blocks = self.submission.speeches.process_feedback(event)
                texts.append(self.feedback_log.add(feedback, t))
                if ending_blocks:
                    self.submission.end(ending_blocks, t)
        if texts:
            for connection in self._connections.values():
                self._send_feedback(connection, texts)

    def _send_due(self, t: float) -> None:
        """Send due feedback and frames before anything changes, also if the session was woken too late.

        A replay of the journal has no wake-ups in between and must publish the same.
        """
        self._publish(t, starts=False)
        if self.broadcast.active:
            self._effects += self.broadcast.frames_due(t, is_reading=True)[0]

    def _send_feedback(self, connection: Connection, texts: list[str]) -> None:
        if (filter := connection.feedback) is not None:
            sends = [Send(connection.id, text) for text in work.counted(texts) if filter.accepts(text)]
            self._effects += sends

    def send_missed_feedback(self, connection: int, seen: int) -> None:
        """Send the feedback after `seen`, and `gap` first if some of it is not stored or never existed."""
        first = self.feedback_log.first
        if seen + 1 < first or seen > self.feedback_log.newest:
            self.reply(connection, Gap(seen=seen, first=first))
            seen = first - 1
        self._send_feedback(self._connections[connection], self.feedback_log.since(seen + 1))

    def send_welcome(self, connection: int, t: float) -> None:
        """Send `welcome` to a connection."""
        seq = self.feedback_log.newest
        self.reply(connection, build_welcome(self.id, t, seq, self.settings, self.capabilities))

    def reply(self, connection: int, reply: Reply) -> None:
        """Send a message to a connection."""
        if not self.closed:
            self._effects.append(Send(connection, reply.text()))
