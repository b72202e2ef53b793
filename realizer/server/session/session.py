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
from realizer.server.documents.document_queue import Intake, name_of
from realizer.server.documents.limits import too_long
from realizer.server.journal import JournalError, Lost, checkpoint
from realizer.server.journal.checkpoint import SessionState
from realizer.server.journal.entry import Kind
from realizer.server.journal.journal_writer import Notes
from realizer.server.session.character_faces import Faces
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.effects import Close, Effect, Move, Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.session.wakeup_plan import Rhythm
from realizer.server.session.welcome import greeting
from realizer.server.speech.audio_clips import ClipError, Clips
from realizer.server.streams.broadcast import Broadcast, Run
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
        capabilities: what `welcome` tells.
        epoch: POSIX seconds at `now`, told with every time; None leaves them out.
        log: the feedback log, in place of a new one.

    Attributes:
        ending: no more documents are taken.
        log: the feedback that it has published.

    `receive`, `spoken`, `drawn` and `tick` do the work; `outgoing` gives what the shell has to do after each
    of them. `tick` is wanted when something is due (`next_due`), and at once while the session `reads`.
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
        self.notes = Notes(id)
        self.faces = Faces(settings)
        self.clips = Clips()
        self.player = Player(
            settings.play_options(scene),
            kinds=KINDS,
            clips=self.clips.recordings,
            face_inputs=lambda index: self.faces.of(index).inputs,
            veto=lambda block, schedule: too_long(block, schedule, settings),
        )
        self.capabilities = dict(capabilities or {})
        self.broadcast = Broadcast(self.player, self.faces)
        self.intake = Intake(id, settings, self.player, self._owe)
        self._connections: dict[int, Connection] = {}
        self.log = log or FeedbackLog(epoch)
        self._effects: list[Effect] = []
        self._rhythm = Rhythm(self.player, self.intake, self.broadcast, self._connections)
        self.subscriptions = Subscriptions(
            settings, self.player, self.faces, self.broadcast, self._connections, self.reply
        )
        self._controls = ControlHandlers(
            self.player, self.faces, self.clips, self.intake, self.subscriptions, self.reply
        )

    # connections --------------------------------------------------------------------------------

    @property
    def connections(self) -> tuple[int, ...]:
        """Ids of the connections that share the session."""
        return tuple(self._connections)

    def connect(self, connection: int, now: float, seen: int | None = None) -> None:
        """A client joins; with `seen` it gets the feedback that followed, otherwise what is to come."""
        self._rhythm.stir()
        self._connections[connection] = Connection(connection, self.log.newest + 1)
        if not self.note(now - self.opened, "join", connection):
            return
        self.empty_since = None
        if seen is not None:
            self.resume(connection, seen)

    def disconnect(self, connection: int, now: float) -> None:
        """A client is gone. A session nobody named ends with it."""
        if self._connections.pop(connection, None) is not None:
            self.note(now - self.opened, "leave", connection)
        self.intake.speeches.leave(connection)
        self._rhythm.unsettled = True
        self._rhythm.stir()
        if not self._connections:
            self.empty_since = now
            if not self.named:
                self.close()

    def dropped(self, connection: int) -> int:
        """How many frames, pictures and packets a client did not get because it was slow."""
        known = self._connections.get(connection)
        return 0 if known is None else known.dropped

    def expired(self, now: float) -> bool:
        """Nobody has been here for `settings.keep` seconds."""
        return self.empty_since is not None and now >= self.empty_since + self.settings.keep

    def close(self) -> None:
        """End: nothing is done and nothing is sent after it."""
        self.closed = True
        self._rhythm.stir()
        self._connections.clear()
        self.intake.inbox.clear()
        self._effects.clear()

    def backlog(self, connection: int, waiting: int) -> None:
        """How many bytes wait to be sent to a client: a slow one loses frames, a stuck one is closed."""
        if (known := self._connections.get(connection)) is not None:
            known.slow = waiting > SLOW
            if known.slow:
                self._rhythm.stir()
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
        if self.notes.grown and not self._compact(t):
            return
        kept = self._dispatch(self._connections[connection], message, t)
        if not self.closed and self._work(t) and not kept:
            self.note(t, "tick")

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
            self.intake.put(message, t)
        else:
            # Not by the player, which would number it: it is not in the journal, and who goes on with the
            # session from there would number all else otherwise.
            told = WarningFeedback(id=name_of(message), type="CANNOT_CREATE_BEHAVIOR", text=words)
            self.tell(told.to_xml())
        return words is None

    def _receive_sound(self, connection: Connection, message: bytes, t: float) -> bool:
        if (words := self._write_journal(t, "sound", connection, message)) is not None:
            self.reply(connection.id, ErrorMessage(code="journal", message=words))
            return False
        try:
            self.clips.take(unpack_clip(message))
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
                    self.note(t, "text", connection.id, json.dumps({"type": "character", "id": name}))
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
            self._effects.append(Move(connection.id, message.session, message.seen))
        else:
            self.welcome(connection.id, t + self.opened)
            if message.seen is not None:
                self.resume(connection.id, message.seen)

    def _state(self, connection: Connection, t: float) -> StateMessage:
        state = self.player.state(t)
        preparing = [
            BlockState(id=w.block.id, character=w.block.character_id, status="IN_PREP")
            for w in self.intake.preparation.waiting
        ]
        faces = [
            CharacterState(face=self.faces.name(index), voice=self.intake.voices.get(index), **face)
            for index, face in enumerate(state["characters"])
        ]
        return StateMessage(
            session=self.id,
            time=t,
            blocks=[*(BlockState(**block) for block in state["blocks"]), *preparing],
            characters=faces,
            voice=VoiceState(name=self.settings.voice, fault=self.intake.orders.fault),
            connections=len(self._connections),
            dropped=connection.dropped,
        )

    # journal ------------------------------------------------------------------------------------

    def _write_journal(
        self, t: float, kind: Kind, connection: Connection, message: str | bytes
    ) -> str | None:
        """Write a message to the journal; returns why it is not taken, or None once it is there."""
        try:
            self.notes.keep(t, kind, connection.id, message)
        except Lost as error:
            self.lose(error)
            return str(error)
        except JournalError as error:
            log.error("session %s: %s", self.id, error)
            return f"this could not be kept, so it is not taken: {error}"
        return None

    def note(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write into the journal what has happened; False where the session is another process's now."""
        try:
            self.notes.tell(t, kind, number, body)
        except Lost as error:
            self.lose(error)
            return False
        return True

    def _compact(self, t: float) -> bool:
        """Replace the journal by a checkpoint if nothing plays; False if another process has the session.

        One whose journal is long, as its face never comes to rest, need only have nothing that plays: then a
        blink or a nod of the next seconds, which goes by what was said last, may be another after a takeover.

        Args:
            t: seconds on the session clock; what was due until then was told.
        """
        if not (self.intake.resting and self.player.is_idle(t if self.notes.overgrown else float("-inf"))):
            return True
        try:
            if self.notes.compact(checkpoint.write(self._saved(t), self.clips.changes())):
                self.clips.settle()
        except Lost as error:
            self.lose(error)
            return False
        return True

    def _saved(self, t: float) -> SessionState:
        past, expected = self.player.blocks.snapshot()
        return SessionState(
            at=t,
            connections=self.connections,
            seq=self.log.newest,
            told=self.log.last(),
            scene=self.player.context.scene,
            characters=self.player.character_states,
            faces=self.faces.given,
            voices=self.intake.voices,
            past=past,
            expected=expected,
            spoken=self.intake.orders.placed,
            fault=self.intake.orders.fault,
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
        self.faces.given.update(state.faces)
        self.intake.voices.update(state.voices)
        self.intake.orders.placed, self.intake.orders.fault = state.spoken, state.fault
        self.clips.restore(clips)
        self.log.restore(state.seq, state.told, state.at)
        for connection in state.connections:
            self.connect(connection, state.at)
        return state.at

    def lose(self, error: Lost) -> None:
        """Another process has the session: let everybody go, to come back there."""
        log.warning("%s", error)
        closing: list[Effect] = [Close(connection, 1012, str(error)) for connection in self._connections]
        self.close()
        self._effects = closing

    def spoken(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """The voice's answer to a Speak. Where it failed, the silent voice takes over."""
        if self.closed:
            return
        t = now - self.opened
        self._publish(t)
        if self.broadcast.active:
            self._effects += self.broadcast.frames_due(t)[0]
        if self.note(t, "spoken", speak, "" if isinstance(result, Utterance) else str(result)):
            self._effects += self.intake.orders.answer(speak, result, t)
            self._work(t)

    def drawn(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """The renderer's answer to a Draw: a picture. Where it failed, pictures end with an error."""
        if self.closed:
            return
        self._rhythm.stir()
        picture = result if isinstance(result, bytes) else None
        effects, lookers = self.broadcast.pictures.drawn(draw, picture, self._connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            for connection in lookers:
                for key in [k for k in connection.subscriptions if k[0] == "video"]:
                    del connection.subscriptions[key]
                self.reply(connection.id, ErrorMessage(code="render", message=str(result), where="video"))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float, *, reads: bool = True) -> None:
        """Do what is due: feedback, sound and frames first, then read or plan one document at most.

        Args:
            reads: or leave documents for another time.
        """
        t = now - self.opened
        if not self.closed and self._work(t, reads):
            self.note(t, "tick")

    def frames(self, now: float) -> tuple[list[Effect], float] | None:
        """These, and feedback, and the `next_due` after them where nothing else is due.

        Returns:
            None where `tick` is wanted, which does the same and more.
        """
        t = now - self.opened
        rhythm = self._rhythm
        if not rhythm.calm(t):
            return None
        if rhythm.tells(t):
            plans = self.player.version
            self._publish(t)
            rhythm.told(plans)
        sends, following = self.broadcast.frames_due(t)
        effects, self._effects = [*self._effects, *sends], []
        return effects, rhythm.go_on(following, self.opened) + self.opened

    @property
    def run(self) -> Run | None:
        """The frames of its only client for which nobody need ask it; None where there is more to it."""
        return self._rhythm.run

    def rest(self, now: float) -> None:
        """Keep the journal short, where it has grown; what is due is told first."""
        if self.notes.grown and not self.closed:
            self._rhythm.stir()
            self._publish(now - self.opened)
            self._compact(now - self.opened)

    def pass_time(
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

    def _work(self, t: float, reads: bool = True) -> bool:
        """What `tick` does; False where nothing came of it but what plays."""
        self._rhythm.unsettled = False
        self._rhythm.stir()
        self._publish(t)
        if self.broadcast.active or any(one.subscriptions for one in self._connections.values()):
            self.broadcast.gets(self._connections.values())
            self.broadcast.due(t, self._effects)
        if self.intake.preparation.waiting:
            self._effects += self.intake.orders.overdue(t + EPSILON)
        # Reading and planning are ticks of their own: the acknowledgement is on its way before planning
        # begins, and frames that are due come in between.
        if not reads:
            return False
        done = self.intake.submit_ready(t) or self.intake.read_one(t)
        if self.intake.speeches.settle(t) or done:
            self._publish(t)
            return True
        return False

    @property
    def reads(self) -> bool:
        """A document can be read or planned at once."""
        return not self.closed and self._rhythm.reads

    def next_due(self) -> float:
        """When something is due that is no document, on the caller's clock; infinite where nothing is."""
        return float("inf") if self.closed else self._rhythm.next() + self.opened

    @property
    def busy(self) -> bool:
        """A block plays, waits or is being prepared."""
        return bool(
            self.intake.inbox or len(self.intake.preparation) or self.player.next_deadline() is not None
        )

    def _owe(self, effects: Iterable[Effect]) -> None:
        self._effects += effects

    def outgoing(self) -> list[Effect]:
        """What the shell has to do, in order; each is told once."""
        effects, self._effects = self._effects, []
        return effects

    # feedback -----------------------------------------------------------------------------------

    def _publish(self, t: float) -> None:
        """Number the feedback that is due, and send it to all connections that take it."""
        texts: list[str] = []
        while due := self.player.due(t + EPSILON):
            for feedback in due:
                told, ends = self.intake.speeches.told(feedback)
                texts.append(self.log.add(told, t))
                if ends:
                    self.intake.end(ends, t)
        if texts:
            for connection in self._connections.values():
                self._send_feedback(connection, texts)

    def _send_feedback(self, connection: Connection, texts: list[str]) -> None:
        connection.place = self.log.newest + 1
        if (wanted := connection.feedback) is not None:
            self._effects += [Send(connection.id, text) for text in texts if wanted.takes(text)]

    def tell(self, feedback: str) -> None:
        """Send everybody who takes it feedback that has no number: nobody who comes back gets it again."""
        for one in self._connections.values():
            if one.feedback is not None and one.feedback.takes(feedback):
                self._effects.append(Send(one.id, feedback))

    def resume(self, connection: int, seen: int) -> None:
        """Send what followed `seen`, after a `gap` where some of it is gone or was never there."""
        first = self.log.first
        if seen + 1 < first or seen > self.log.newest:
            self.reply(connection, Gap(seen=seen, first=first))
            seen = first - 1
        known = self._connections[connection]
        known.place = seen + 1
        self._send_feedback(known, self.log.since(known.place))

    def welcome(self, connection: int, now: float) -> None:
        """Tell a client where it is and what there is."""
        t, seq = now - self.opened, self.log.newest
        self.reply(connection, greeting(self.id, t, seq, self.settings, self.capabilities))

    def reply(self, connection: int, reply: Reply) -> None:
        if not self.closed:
            self._effects.append(Send(connection, reply.text()))
