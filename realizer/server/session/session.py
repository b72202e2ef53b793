"""A session: it takes documents, control messages and the time, and returns effects.

It opens no sockets and reads no clock.
"""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Mapping
from typing import Any

from bml_schema import BMLError, WarningFeedback
from bml_schema.reading.encodings import decode
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import KINDS
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.protocol.messages.parse import parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Control
from realizer.protocol.streams import KINDS as FRAMES
from realizer.server.documents.document_queue import Submission, block_id_of
from realizer.server.documents.limits import duration_error
from realizer.server.journal import TakenOver
from realizer.server.journal.checkpoint import Checkpoint
from realizer.server.journal.entry import Kind
from realizer.server.journal.session_journal import SessionJournal
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connection, Connections, FeedbackLog
from realizer.server.session.control_handlers import PASSING, ControlHandlers
from realizer.server.session.effects import Close, Effect, Sight
from realizer.server.session.query_handlers import QueryHandlers
from realizer.server.session.session_clock import SessionClock
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.session.ticker import Ticker
from realizer.server.session.tracked_faces import TrackedFaces
from realizer.server.speech.audio_clips import AudioClips
from realizer.server.streams.broadcast import Broadcast
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)


class Session:
    """A clock, characters, blocks, a scene and a feedback log, and the connections that share them.

    The host calls `receive`, `on_speech`, `on_picture`, `on_sight` and `tick`, and carries out `take_effects`
    after each call. It calls `tick` at `next_due`, and immediately while the session `has_documents`.
    Parameters `now` are seconds on the host's clock, `t` seconds on the session clock.

    Args:
        now: the session clock starts here. If the host's clock goes back, the session clock waits.
        named: whether a client chose the name: then the session outlives its last connection by
            `settings.keep`.
        epoch: POSIX seconds at `now`, added to every time in feedback; None leaves them out.
        log: the feedback log of another session, to continue it.

    Attributes:
        is_ending: whether documents are refused because the service is ending.
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
        self.named = named
        self.closed = False
        self.is_ending = False
        self.empty_since: float | None = now
        self.failures: list[float] = []  # when it was recovered lately, on the host's clock
        self._scene, self._capabilities = scene, capabilities or {}
        self._effects: list[Effect] = []
        self.make_parts(now, log or FeedbackLog(epoch))

    def make_parts(self, now: float, log: FeedbackLog) -> None:
        """Make the parts of a new session, or anew those of one that has failed.

        Args:
            now: the session clock starts here.
            log: the log that feedback is added to.
        """
        id, settings = self.id, self.settings
        self.clock = SessionClock(now)
        self.faces = CharacterFaces(settings)
        self.clips = AudioClips()
        self.player = Player(
            settings.play_options(self._scene),
            kinds=KINDS,
            clips=self.clips.recordings,
            face_inputs=lambda index: self.faces.of(index).inputs,
            veto=lambda block, schedule: duration_error(block, schedule, settings),
        )
        self.broadcast = Broadcast(self.player, self.faces)
        self.submission = Submission(id, settings, self.player, self._effects.extend)
        self.feedback_log = log
        self.connections = Connections(self.feedback_log, self._effects.extend)
        checkpoint = Checkpoint(self.player, self.faces, self.clips, self.submission, self.feedback_log)
        self.journal = SessionJournal(id, checkpoint, self.connections, self.hand_over)
        self.subscriptions = Subscriptions(
            settings, self.player.cast, self.faces, self.broadcast, self.connections
        )
        self.tracked = TrackedFaces(self.player.cast, self.connections, self._handle)
        self.queries = QueryHandlers(
            id, settings, self._capabilities, self.player, self.faces, self.submission, self.connections
        )
        self._controls = ControlHandlers(
            self.player,
            self.faces,
            self.clips,
            self.submission,
            self.subscriptions,
            self.queries,
            self.tracked,
            self.connections.reply,
        )
        self.ticker = Ticker(
            self.clock, self.player, self.submission, self.broadcast, self.connections, self._controls
        )

    # connections --------------------------------------------------------------------------------

    def connect(
        self, connection: int, now: float, seen: int | None = None, *, may_edit: bool = False
    ) -> None:
        """Add a connection. With `seen` it gets all feedback after that one, without it only new feedback."""
        if self.closed:  # it ended while the client waited for it
            self._effects.append(Close(connection, 1012, f"session {self.id} has ended: reconnect"))
            return
        may_edit = may_edit and self.settings.edit is not None
        sent = self.feedback_log.newest
        self.connections[connection] = Connection(connection, may_edit=may_edit, sent=sent)
        if not self.journal.note(self.clock.read(now), "join", connection):
            return
        self.empty_since = None
        if seen is not None:
            self.connections.send_missed_feedback(connection, seen)

    def disconnect(self, connection: int, now: float, *, is_awaited: bool = False) -> None:
        """Remove a connection. An unnamed session closes with its last connection.

        Args:
            is_awaited: whether other clients will connect at once: then it stays open.
        """
        if self.connections.pop(connection, None) is not None:
            self.journal.note(self.clock.read(now), "leave", connection)
        self._controls.on_disconnect(connection, self.clock.read(now))
        self.tracked.drop(connection)
        self.ticker.must_end_speech = True
        if not self.connections:
            self.empty_since = now
            if not self.named and not is_awaited:
                self.close()

    def is_expired(self, now: float) -> bool:
        """Whether the session has had no connection for `settings.keep` seconds."""
        return self.empty_since is not None and now >= self.empty_since + self.settings.keep

    def close(self) -> None:
        """Close the session: it does and sends nothing any more."""
        self.closed = True
        self.connections.clear()
        self.submission.queue.clear()
        self.player.clear()
        self._effects.clear()

    def update_backlog(self, connection: int, waiting: int) -> None:
        """Take the number of unsent bytes of a client, as `Connections.update_backlog`."""
        if self.connections.update_backlog(connection, waiting):
            self.ticker.quiet_until = -math.inf

    # messages in --------------------------------------------------------------------------------

    def receive(self, connection: int, message: str | bytes, now: float) -> None:
        """Handle a message: a picture or sound in bytes, a control message that starts with `{`, or BML."""
        if self.closed or connection not in self.connections:
            return
        message = _as_text(message) if isinstance(message, bytes) else message
        t = self.clock.read(now)
        self.ticker.send_before_change(t)
        if self.journal.needs_checkpoint and not self.journal.compact(t):
            return
        in_journal = self._handle(connection, message, t)
        if not self.closed and self.ticker.tick(t) and not in_journal:
            self.journal.note(t, "tick")

    def _handle(self, id: int, message: str | bytes, t: float) -> bool:
        """Handle a message. Return whether it was written to the journal."""
        if (connection := self.connections.get(id)) is None:
            return False
        if isinstance(message, bytes) and self.tracked.receive(id, message, t):
            return False
        control: Control | None = None
        if isinstance(message, str) and (text := message.lstrip("\ufeff \t\r\n")).startswith("{"):
            parsed = parse_control(text, can_save=connection.may_edit)
            if isinstance(parsed, ErrorMessage):
                self.connections.reply(id, parsed)
                return False
            if isinstance(parsed, PASSING):
                self._handle_passing(connection, parsed, t)
                return False
            control = parsed
        is_bml = control is None and isinstance(message, str)
        ending = "the service is ending and takes no more documents" if self.is_ending and is_bml else None
        kind: Kind = "text" if isinstance(message, str) else "sound"
        refused = ending or self.journal.accept(t, kind, id, message)
        if refused is not None and is_bml:
            # Without a number: the message is not in the journal, and a session that is restored from the
            # journal must number all other feedback in the same way.
            block = block_id_of(str(message))
            warning = WarningFeedback(id=block, type="CANNOT_CREATE_BEHAVIOR", text=refused)
            self.connections.send_feedback([warning.to_xml()])
        elif refused is not None:
            self.connections.reply(id, ErrorMessage(code="journal", message=refused))
        elif isinstance(message, bytes):
            self._controls.handle_sound(connection, message, t)
        elif control is not None:
            self._controls.handle(connection, control, t)
        else:
            self.submission.enqueue(message, id)
        return refused is None

    def _handle_passing(self, connection: Connection, control: Control, t: float) -> None:
        """Handle a message that is not written to the journal, except for the characters that it adds."""
        known = self.player.characters
        self._controls.handle(connection, control, t)
        for name in self.player.characters:
            if name not in known:  # their order matters: the first is the default
                self.journal.note(t, "text", connection.id, json.dumps({"type": "character", "id": name}))

    # answers to effects -----------------------------------------------------------------------------

    def on_speech(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """Take the answer to an effect `Speak`. If the voice failed, the silent voice replaces it."""
        if self.closed:
            return
        t = self.clock.read(now)
        self.ticker.send_before_change(t)
        if self.journal.note(t, "spoken", speak, "" if isinstance(result, Utterance) else str(result)):
            self._effects += self.submission.tts.answer(speak, result, t)
            self.ticker.tick(t)

    def on_picture(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """Take the answer to an effect `Draw`. If it is an error, the subscriptions to the picture end."""
        if self.closed:
            return
        effects, viewers = self.broadcast.video.on_picture(draw, result, self.connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            self.subscriptions.end_pictures(viewers, str(result))
        self.tick(now)

    def on_sight(self, connection: int, result: Sight | RealizerError | None, now: float) -> None:
        """Take the answer to an effect `Look`."""
        if self.closed:
            return
        self.tracked.answer(connection, result, self.clock.read(now))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float, *, read_documents: bool = True) -> None:
        """Send due feedback, sound and frames; then, with `read_documents`, read or plan one document."""
        t = self.clock.read(now)
        starts = not self.submission.has_work
        if not self.closed and self.ticker.tick(t, read_documents, starts=starts):
            self.journal.note(t, "tick")

    @property
    def has_documents(self) -> bool:
        """Whether a document can be read or planned now."""
        return not self.closed and self.ticker.has_documents

    def next_due(self) -> float:
        """Return the time of the next event other than documents; infinity if there is none."""
        return math.inf if self.closed else self.ticker.next_time() + self.clock.opened

    @property
    def busy(self) -> bool:
        """Whether a block plays, waits or is being prepared."""
        submission = self.submission
        return bool(submission.queue or submission.pending.blocks) or self.player.next_deadline() is not None

    def take_effects(self) -> list[Effect]:
        """Return the effects since the last call, in order."""
        effects = self._effects.copy()
        self._effects.clear()
        return effects

    # journal ----------------------------------------------------------------------------------------

    def hand_over(self, error: TakenOver) -> None:
        """Close all connections because another process has taken over; clients reconnect there."""
        log.warning("%s", error)
        closing = [Close(connection, 1012, str(error)) for connection in self.connections]
        self.close()
        self._effects += closing

    def compact_journal(self, now: float) -> None:
        """Replace the journal by a checkpoint if it has grown; due feedback is published first."""
        if self.journal.needs_checkpoint and not self.closed:
            self.ticker.publish(t := self.clock.read(now))
            self.journal.compact(t)


_BLANKS = b"\xef\xbb\xbf\xff\xfe\0 \t\r\n"  # of a text in UTF-8 or UTF-16


def _as_text(message: bytes) -> str | bytes:
    """Return the text of a binary message that begins as BML or a control message does, not as a frame."""
    if not message or message[0] in FRAMES or message.lstrip(_BLANKS)[:1] not in (b"<", b"{"):
        return message
    try:
        return decode(message)[0]
    except BMLError:
        return message.decode("utf-8", "replace")
