"""One session: documents and control messages in, effects out. No sockets, no clock: it is told `now`.

A document's way from the socket to its schedule:

    transports.websocket.connection  reads the message, no faster than a client may send
    runtime.session_host             finds the session of the connection
    Session.receive                  publishes what is due, writes the journal
    documents.document_queue         keeps the text; parses one document a tick, checks limits, acknowledges
    documents.pending_blocks         keeps the block until its speech and the blocks before it are there
    documents.tts_requests           asks voices for its speech, by effects `Speak` that runtime.engines does
    Session.spoken                   takes the voice's answer; the next tick submits the block
    playback.player                  resolves, schedules and places it; its feedback comes due by and by
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from bml_schema import WarningFeedback
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import KINDS
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
from realizer.server.journal import JournalError, TakenOver, checkpoint
from realizer.server.journal.checkpoint import SessionState
from realizer.server.journal.entry import Kind
from realizer.server.journal.journal_writer import JournalWriter
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.effects import Close, Effect, MoveConnection, Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.session.wakeup_plan import WakeupPlan
from realizer.server.session.welcome import build_welcome
from realizer.server.speech.audio_clips import AudioClips, ClipError
from realizer.server.streams.broadcast import Broadcast, FrameRun
from realizer.server.streams.connection import SLOW, STUCK, Connection
from realizer.server.streams.frame_windows import EPSILON
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)

# Messages that change nothing for others, nor for who comes later.
PASSING = (Hello, Ping, StateQuery, Subscribe, Unsubscribe)


class Session:
    """A clock, characters, blocks, a scene and the feedback log; and the connections that share them.

    Args:
        id: its name.
        settings: limits and defaults.
        now: seconds on the caller's clock; the session's own clock starts here.
        named: it was asked for by name, and outlives its last connection by `settings.keep`.
        scene: where targets are, to begin with.
        capabilities: what `send_welcome` tells.
        epoch: POSIX seconds at `now`, told with every time; None leaves them out.
        log: the feedback log, in place of a new one.

    Attributes:
        ending: no more documents are taken.
        feedback_log: the feedback that it has published.

    `receive`, `on_speech`, `on_picture` and `tick` do the work; `take_effects` gives what the shell has to do
    after each of them. `tick` is wanted when something is due (`next_due`), and at once while the session
    `has_documents`.
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
        self.opened = now
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
        self.submission = Submission(id, settings, self.player, self._add_effects)
        self._connections: dict[int, Connection] = {}
        self.feedback_log = log or FeedbackLog(epoch)
        self._effects: list[Effect] = []
        self._wakeups = WakeupPlan(self.player, self.submission, self.broadcast, self._connections)
        self.subscriptions = Subscriptions(
            settings, self.player, self.faces, self.broadcast, self._connections, self.reply
        )
        self._controls = ControlHandlers(
            self.player, self.faces, self.clips, self.submission, self.subscriptions, self.reply
        )

    # connections --------------------------------------------------------------------------------

    @property
    def connections(self) -> tuple[int, ...]:
        """Ids of the connections that share the session."""
        return tuple(self._connections)

    def connect(self, connection: int, now: float, seen: int | None = None) -> None:
        """A client joins; with `seen` it gets the feedback that followed, otherwise what is to come."""
        self._wakeups.invalidate()
        self._connections[connection] = Connection(connection, self.feedback_log.newest + 1)
        if not self.log_entry(now - self.opened, "join", connection):
            return
        self.empty_since = None
        if seen is not None:
            self.send_missed_feedback(connection, seen)

    def disconnect(self, connection: int, now: float) -> None:
        """A client is gone. A session nobody named ends with it."""
        if self._connections.pop(connection, None) is not None:
            self.log_entry(now - self.opened, "leave", connection)
        self.submission.speeches.on_disconnect(connection)
        self._wakeups.unsettled = True
        self._wakeups.invalidate()
        if not self._connections:
            self.empty_since = now
            if not self.named:
                self.close()

    def dropped_count(self, connection: int) -> int:
        """How many frames, pictures and packets a client did not get because it was slow."""
        known = self._connections.get(connection)
        return 0 if known is None else known.dropped

    def is_expired(self, now: float) -> bool:
        """Nobody has been here for `settings.keep` seconds."""
        return self.empty_since is not None and now >= self.empty_since + self.settings.keep

    def close(self) -> None:
        """End: nothing is done and nothing is sent after it."""
        self.closed = True
        self._wakeups.invalidate()
        self._connections.clear()
        self.submission.queue.clear()
        self._effects.clear()

    def update_backlog(self, connection: int, waiting: int) -> None:
        """How many bytes wait to be sent to a client: a slow one loses frames, a stuck one is closed."""
        if (known := self._connections.get(connection)) is not None:
            known.is_slow = waiting > SLOW
            if known.is_slow:
                self._wakeups.invalidate()
            if waiting > STUCK:
                reason = f"{waiting} bytes wait to be read; come back with the session's name and seen"
                self._effects.append(Close(connection, 1013, reason))

    # messages in --------------------------------------------------------------------------------

    def receive(self, connection: int, message: str | bytes, now: float) -> None:
        """A WebSocket message: bytes are a sound clip; text is control if it starts with `{`, or else BML."""
        if self.closed or connection not in self._connections:
            return
        t = now - self.opened
        # What was due is told before anything changes, whether somebody woke the session in time or not:
        # who does all of it again from the journal is not woken in between. Frames whose time has come are
        # sent as they were planned then.
        self._publish(t)
        if self.broadcast.active:
            self._effects += self.broadcast.frames_due(t)[0]
        if self.journal.needs_checkpoint and not self._compact(t):
            return
        kept = self._dispatch(self._connections[connection], message, t)
        if not self.closed and self._work(t) and not kept:
            self.log_entry(t, "tick")

    def _dispatch(self, connection: Connection, message: str | bytes, t: float) -> bool:
        """Do what a message asks for, or reply why not; returns whether it is in the journal."""
        if isinstance(message, bytes):
            return self._receive_sound(connection, message, t)
        if (text := message.lstrip("\ufeff \t\r\n")).startswith("{"):
            control = parse_control(text)
            if isinstance(control, ErrorMessage):
                self.reply(connection.id, control)
                return False
            return self._receive_control(connection, control, message, t)
        if self.ending:
            words: str | None = "the service is ending and takes no more documents"
        else:
            words = self._write_journal(t, "text", connection, message)
        if words is None:
            self.submission.enqueue(message, t)
        else:
            # Not by the player, which would number it: it is not in the journal, and who goes on with the
            # session from there would number all else otherwise.
            told = WarningFeedback(id=block_id_of(message), type="CANNOT_CREATE_BEHAVIOR", text=words)
            self.send_unnumbered(told.to_xml())
        return words is None

    def _receive_sound(self, connection: Connection, message: bytes, t: float) -> bool:
        if (words := self._write_journal(t, "sound", connection, message)) is not None:
            self.reply(connection.id, ErrorMessage(code="journal", message=words))
            return False
        try:
            self.clips.add_chunk(unpack_clip(message))
        except WireError as error:
            self.reply(connection.id, ErrorMessage(code="unsupported", message=str(error)))
        except ClipError as error:
            self.reply(connection.id, ErrorMessage(code="clip", message=str(error), where=error.where))
        return True

    def _receive_control(self, connection: Connection, control: Control, message: str, t: float) -> bool:
        if isinstance(control, PASSING):
            known = self.player.characters
            self._handle(connection, control, t)
            for name in self.player.characters:
                if name not in known:  # who is named first is who moves where nobody is named
                    self.log_entry(t, "text", connection.id, json.dumps({"type": "character", "id": name}))
            return False
        if (words := self._write_journal(t, "text", connection, message)) is not None:
            self.reply(connection.id, ErrorMessage(code="journal", message=words))
            return False
        self._handle(connection, control, t)
        return True

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
            words = f"wanted version {PROTOCOL} of the protocol, got {message.version}"
            self.reply(connection.id, ErrorMessage(code="version", message=words, where="hello.version"))
        elif message.session not in (None, self.id):
            assert message.session is not None
            self._effects.append(MoveConnection(connection.id, message.session, message.seen))
        else:
            self.send_welcome(connection.id, t + self.opened)
            if message.seen is not None:
                self.send_missed_feedback(connection.id, message.seen)

    def _state(self, connection: Connection, t: float) -> StateMessage:
        state = self.player.state(t)
        preparing = [
            BlockState(id=w.block.id, character=w.block.character_id, status="IN_PREP")
            for w in self.submission.pending.blocks
        ]
        faces = [
            CharacterState(face=self.faces.name(index), voice=self.submission.voices.get(index), **face)
            for index, face in enumerate(state["characters"])
        ]
        return StateMessage(
            session=self.id,
            time=t,
            blocks=[*(BlockState(**block) for block in state["blocks"]), *preparing],
            characters=faces,
            voice=VoiceState(name=self.settings.voice, fault=self.submission.tts.fault),
            connections=len(self._connections),
            dropped=connection.dropped,
        )

    # journal ------------------------------------------------------------------------------------

    def _write_journal(
        self, t: float, kind: Kind, connection: Connection, message: str | bytes
    ) -> str | None:
        """Write a message to the journal; returns why it is not taken, or None once it is there."""
        try:
            self.journal.append(t, kind, connection.id, message)
        except TakenOver as error:
            self.hand_over(error)
            return str(error)
        except JournalError as error:
            log.error("session %s: %s", self.id, error)
            return f"this could not be kept, so it is not taken: {error}"
        return None

    def log_entry(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write into the journal what has happened; False where the session is another process's now."""
        try:
            self.journal.try_append(t, kind, number, body)
        except TakenOver as error:
            self.hand_over(error)
            return False
        return True

    def _compact(self, t: float) -> bool:
        """Replace the journal by a checkpoint if nothing plays; False if another process has the session.

        One whose journal is long, as its face never comes to rest, need only have nothing that plays: then a
        blink or a nod of the next seconds, which goes by what was said last, may be another after a takeover.

        Args:
            t: seconds on the session clock; what was due until then was told.
        """
        if not (
            self.submission.is_idle
            and self.player.is_idle(t if self.journal.is_far_too_long else float("-inf"))
        ):
            return True
        try:
            if self.journal.compact(checkpoint.write(self._state_to_save(t), self.clips.changes())):
                self.clips.settle()
        except TakenOver as error:
            self.hand_over(error)
            return False
        return True

    def _state_to_save(self, t: float) -> SessionState:
        past, expected = self.player.blocks.snapshot()
        return SessionState(
            at=t,
            connections=self.connections,
            seq=self.feedback_log.newest,
            last_messages=self.feedback_log.last(),
            scene=self.player.context.scene,
            characters=self.player.character_states,
            faces=self.faces.assigned,
            voices=self.submission.voices,
            past=past,
            expected=expected,
            request_count=self.submission.tts.request_count,
            fault=self.submission.tts.fault,
            clips=self.clips.ids,
        )

    def restore(self, parts: Mapping[str, str]) -> float:
        """Become, as a new session opened at 0, what one was at its checkpoint, with its connections.

        Args:
            parts: as `Kept` has them.

        Returns:
            Seconds on its clock.

        Raises:
            JournalError: these are no parts, or of another version.
        """
        state, clips = checkpoint.read(self.id, parts)
        self.player.set_scene(state.scene)
        self.player.restore(state.characters, state.past, state.expected)
        self.faces.assigned.update(state.faces)
        self.submission.voices.update(state.voices)
        self.submission.tts.request_count, self.submission.tts.fault = state.request_count, state.fault
        self.clips.restore(clips)
        self.feedback_log.restore(state.seq, state.last_messages, state.at)
        for connection in state.connections:
            self.connect(connection, state.at)
        return state.at

    def hand_over(self, error: TakenOver) -> None:
        """Another process has the session: let everybody go, to come back there."""
        log.warning("%s", error)
        closing: list[Effect] = [Close(connection, 1012, str(error)) for connection in self._connections]
        self.close()
        self._effects = closing

    def on_speech(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """The voice's answer to a Speak. Where it failed, the silent voice takes over."""
        if self.closed:
            return
        t = now - self.opened
        self._publish(t)
        if self.broadcast.active:
            self._effects += self.broadcast.frames_due(t)[0]
        if self.log_entry(t, "spoken", speak, "" if isinstance(result, Utterance) else str(result)):
            self._effects += self.submission.tts.answer(speak, result, t)
            self._work(t)

    def on_picture(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """The renderer's answer to a Draw: a picture. Where it failed, pictures end with an error."""
        if self.closed:
            return
        self._wakeups.invalidate()
        picture = result if isinstance(result, bytes) else None
        effects, lookers = self.broadcast.video.on_picture(draw, picture, self._connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            for connection in lookers:
                for key in [k for k in connection.subscriptions if k[0] == "video"]:
                    del connection.subscriptions[key]
                self.reply(connection.id, ErrorMessage(code="render", message=str(result), where="video"))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float, *, read_documents: bool = True) -> None:
        """Do what is due: feedback, sound and frames first, then read or plan one document at most.

        Args:
            read_documents: or leave documents for another time.
        """
        t = now - self.opened
        if not self.closed and self._work(t, read_documents):
            self.log_entry(t, "tick")

    def frames(self, now: float) -> tuple[list[Effect], float] | None:
        """These, and feedback, and the `next_due` after them where nothing else is due.

        Returns:
            None where `tick` is wanted, which does the same and more.
        """
        t = now - self.opened
        rhythm = self._wakeups
        if not rhythm.only_frames_due(t):
            return None
        if rhythm.feedback_due(t):
            plans = self.player.version
            self._publish(t)
            rhythm.feedback_sent(plans)
        sends, following = self.broadcast.frames_due(t)
        effects, self._effects = [*self._effects, *sends], []
        return effects, rhythm.next_after_frames(following, self.opened) + self.opened

    @property
    def fast_path(self) -> FrameRun | None:
        """The frames of its only client for which nobody need ask it; None where there is more to it."""
        return self._wakeups.fast_path

    def compact_journal(self, now: float) -> None:
        """Keep the journal short, where it has grown; what is due is told first."""
        if self.journal.needs_checkpoint and not self.closed:
            self._wakeups.invalidate()
            self._publish(now - self.opened)
            self._compact(now - self.opened)

    def replay_until(
        self, t: float, look: Callable[[float], None] = lambda t: None, *, since: float = 0.0
    ) -> None:
        """Tell what comes due before `t` on the session clock, each at its own time; for who replays it.

        Args:
            look: is called with each of those times, before anything happens then.
            since: what is owed at once is told then.
        """
        while (due := self.player.next_deadline()) is not None and due < t and not self.closed:
            due = max(due, since)
            look(due)
            self._publish(due)

    def _work(self, t: float, read_documents: bool = True) -> bool:
        """What `tick` does; False where nothing came of it but what plays."""
        self._wakeups.unsettled = False
        self._wakeups.invalidate()
        self._publish(t)
        if self.broadcast.active or any(one.subscriptions for one in self._connections.values()):
            self.broadcast.set_subscribers(self._connections.values())
            self.broadcast.send_due(t, self._effects)
        if self.submission.pending.blocks:
            self._effects += self.submission.tts.expire(t + EPSILON)
        # Reading and planning are ticks of their own: the acknowledgement is on its way before planning
        # begins, and frames that are due come in between.
        if not read_documents:
            return False
        done = self.submission.plan_next(t) or self.submission.parse_next(t)
        if self.submission.speeches.advance(t) or done:
            self._publish(t)
            return True
        return False

    @property
    def has_documents(self) -> bool:
        """A document can be read or planned at once."""
        return not self.closed and self._wakeups.has_documents

    def next_due(self) -> float:
        """When something is due that is no document, on the caller's clock; infinite where nothing is."""
        return float("inf") if self.closed else self._wakeups.next() + self.opened

    @property
    def busy(self) -> bool:
        """A block plays, waits or is being prepared."""
        return bool(
            self.submission.queue or len(self.submission.pending) or self.player.next_deadline() is not None
        )

    def _add_effects(self, effects: Iterable[Effect]) -> None:
        self._effects += effects

    def take_effects(self) -> list[Effect]:
        """What the shell has to do, in order; each is told once."""
        effects, self._effects = self._effects, []
        return effects

    # feedback -----------------------------------------------------------------------------------

    def _publish(self, t: float) -> None:
        """Number the feedback that is due, and send it to all connections that take it."""
        texts: list[str] = []
        while due := self.player.due(t + EPSILON):
            for feedback in due:
                told, ends = self.submission.speeches.process_feedback(feedback)
                texts.append(self.feedback_log.add(told, t))
                if ends:
                    self.submission.end(ends, t)
        if texts:
            for connection in self._connections.values():
                self._send_feedback(connection, texts)

    def _send_feedback(self, connection: Connection, texts: list[str]) -> None:
        connection.next_seq = self.feedback_log.newest + 1
        if (wanted := connection.feedback) is not None:
            self._effects += [Send(connection.id, text) for text in texts if wanted.accepts(text)]

    def send_unnumbered(self, feedback: str) -> None:
        """Send everybody who takes it feedback that has no number: nobody who comes back gets it again."""
        for one in self._connections.values():
            if one.feedback is not None and one.feedback.accepts(feedback):
                self._effects.append(Send(one.id, feedback))

    def send_missed_feedback(self, connection: int, seen: int) -> None:
        """Send what followed `seen`, after a `gap` where some of it is gone or was never there."""
        first = self.feedback_log.first
        if seen + 1 < first or seen > self.feedback_log.newest:
            self.reply(connection, Gap(seen=seen, first=first))
            seen = first - 1
        known = self._connections[connection]
        known.next_seq = seen + 1
        self._send_feedback(known, self.feedback_log.since(known.next_seq))

    def send_welcome(self, connection: int, now: float) -> None:
        """Tell a client where it is and what there is."""
        t, seq = now - self.opened, self.feedback_log.newest
        self.reply(connection, build_welcome(self.id, t, seq, self.settings, self.capabilities))

    def reply(self, connection: int, reply: Reply) -> None:
        if not self.closed:
            self._effects.append(Send(connection, reply.text()))
