"""One session: documents and control messages in, effects out. No sockets, no clock: it is told `now`."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bml_schema import Block
from realizer.animation.mapping import FapMapping
from realizer.behaviours import KINDS
from realizer.behaviours.kind import Position
from realizer.errors import RealizerError
from realizer.mapping import mapping_of
from realizer.pipeline import as_it_is, warped
from realizer.player import HISTORY, Player
from realizer.scheduling.timing import Warning
from realizer.server.broadcast import Broadcast
from realizer.server.clips import ClipError, Clips
from realizer.server.connection import STUCK, Connection
from realizer.server.control import follow
from realizer.server.effects import Close, Effect, Move, Send
from realizer.server.feedback_log import FeedbackLog
from realizer.server.inbox import Inbox, name_of
from realizer.server.journal import JournalError, Lost
from realizer.server.journal.entry import Kind
from realizer.server.journal.notes import Notes
from realizer.server.limits import MAX_CHARACTERS, beyond
from realizer.server.messages import (
    MAX_CONTROL,
    MAX_FPS,
    PICTURES,
    STREAMS,
    Capabilities,
    ErrorMessage,
    Gap,
    Hello,
    Limits,
    Ping,
    StateQuery,
    Subscribe,
    Unsubscribe,
    Welcome,
    parse_control,
)
from realizer.server.orders import Orders
from realizer.server.preparation import Preparation, Waiting
from realizer.server.speeches import Speeches
from realizer.server.streams import EPSILON
from realizer.server.wire import WireError, unpack_clip
from realizer.settings import Settings
from realizer.speech.utterance import Say, Utterance

if TYPE_CHECKING:
    from realizer.face.model import Face

__all__ = ["Session"]

log = logging.getLogger(__name__)

# Messages that change nothing for others, nor for who comes later.
PASSING = (Hello, Ping, StateQuery, Subscribe, Unsubscribe)
# Feedback that is kept for clients that come back: about an hour of talk.
LOG = 10_000


class Session:
    """A clock, characters, blocks, a scene and the feedback log; and the connections that share them.

    Args:
        id: its name.
        settings: limits and defaults.
        now: seconds on the caller's clock; the session's own clock starts here.
        named: it was asked for by name, and outlives its last connection by `settings.keep`.
        scene: where targets are, to begin with.
        load_face: name -> Face, raising FaceError.
        capabilities: what `welcome` tells.
        epoch: POSIX seconds at `now`, told with every time; None leaves them out.
        history: seconds that have passed of which frames can still be asked for.

    `receive`, `spoken`, `drawn` and `tick` do the work; `outgoing` gives what the shell has to do after each
    of them, and `next_deadline` says when `tick` is wanted.
    """

    def __init__(
        self,
        id: str,
        settings: Settings,
        now: float,
        *,
        named: bool = False,
        scene: Mapping[str, Position] | None = None,
        load_face: Callable[[str], Face] | None = None,
        capabilities: Mapping[str, Any] | None = None,
        epoch: float | None = None,
        history: float = HISTORY,
    ) -> None:
        self.id = id
        self.settings = settings
        self.opened = now
        self.named = named
        self.closed = False
        self.ending = False  # the service ends: no new documents
        self.empty_since: float | None = now
        self.notes = Notes(id)
        self.clips = Clips()
        self.player = Player(
            kinds=KINDS,
            scene=scene,
            seed=settings.seed,
            idle=settings.idle,
            language=settings.language,
            media=settings.media,
            clips=self.clips.recordings,
            expressions=settings.expressions,
            history=history,
            cooccurrence=settings.cooccurrence,
            prosody=settings.prosody,
            takes=lambda index: self.face(index).takes,
        )
        self.load_face = load_face or (lambda name: _load_face(name, settings.deformer))
        self.capabilities = dict(capabilities or {})
        self.faces: dict[int, str] = {}
        self.voices: dict[int, str] = {}
        self.broadcast = Broadcast(self.player, self.face, self.mapping, self.face_name)
        self.preparation = Preparation()
        self.speeches = Speeches(self.player)
        self.orders = Orders(self.player, self.preparation)
        self._connections: dict[int, Connection] = {}
        self._inbox = Inbox(settings.max_document)
        self.log = FeedbackLog(LOG if history < float("inf") else None, epoch)
        self._effects: list[Effect] = []
        self._unsettled = False  # who has left may have left speeches, which end now: nothing else says when

    # connections --------------------------------------------------------------------------------

    @property
    def connections(self) -> tuple[int, ...]:
        """Ids of the connections that share the session."""
        return tuple(self._connections)

    def connect(self, connection: int, now: float, seen: int | None = None) -> None:
        """A client joins; with `seen` it gets the feedback that followed, otherwise what is to come."""
        self._connections[connection] = Connection(connection, self.log.newest + 1)
        if not self._tell(now - self.opened, "join", connection):
            return
        self.empty_since = None
        if seen is not None:
            self.resume(connection, seen)

    def disconnect(self, connection: int, now: float) -> None:
        """A client is gone. A session nobody named ends with it."""
        if self._connections.pop(connection, None) is not None:
            self._tell(now - self.opened, "leave", connection)
        self.speeches.leave(connection)
        self._unsettled = True
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
        self._connections.clear()
        self._inbox.clear()
        self._effects.clear()

    def backlog(self, connection: int, waiting: int) -> None:
        """How many bytes wait to be sent to a client: a slow one loses frames, a stuck one is closed."""
        if (known := self._connections.get(connection)) is not None:
            known.backlog = waiting
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
        # who does all of it again from the journal is not woken in between.
        self._publish(t)
        kept = False
        if isinstance(message, bytes):
            if kept := self._keep(t, "sound", connection, message):
                self._take_clip(connection, message)
        elif message.lstrip("\ufeff \t\r\n").startswith("{"):
            control = parse_control(message.lstrip("\ufeff \t\r\n"))
            if isinstance(control, ErrorMessage):
                self.reply(connection, control)
            elif isinstance(control, PASSING):
                known = self.player.characters
                follow(self, self._connections[connection], control, t)
                for name in self.player.characters:
                    if name not in known:  # who is named first is who moves where nobody is named
                        self._tell(t, "text", connection, json.dumps({"type": "character", "id": name}))
            elif kept := self._keep(t, "text", connection, message):
                follow(self, self._connections[connection], control, t)
        else:
            kept = self._keep(t, "text", connection, message)
            if kept and (refused := self._inbox.put(message)) is not None:
                self._refuse(refused, t)
        if not self.closed and self._work(t) and not kept:
            self._tell(t, "tick")

    def _keep(self, t: float, kind: Kind, connection: int, message: str | bytes) -> bool:
        """Write a message into the journal; where that cannot be it is not taken, and its client is told."""
        try:
            self.notes.keep(t, kind, connection, message)
        except Lost as error:
            self._lose(error)
            return False
        except JournalError as error:
            log.error("session %s: %s", self.id, error)
            words = f"this could not be kept, so it is not taken: {error}"
            if isinstance(message, str) and message.lstrip("\ufeff \t\r\n").startswith("<"):
                self._refuse(Warning(name_of(message), "CANNOT_CREATE_BEHAVIOR", words), t)
            else:
                self.reply(connection, ErrorMessage(code="journal", message=words))
            return False
        return True

    def _tell(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write into the journal what has happened; False where the session is another process's now."""
        try:
            self.notes.tell(t, kind, number, body)
        except Lost as error:
            self._lose(error)
            return False
        return True

    def _lose(self, error: Lost) -> None:
        """Another process has the session: let everybody go, to come back there."""
        log.warning("%s", error)
        closing: list[Effect] = [Close(connection, 1012, str(error)) for connection in self._connections]
        self.close()
        self._effects = closing

    def _take_clip(self, connection: int, message: bytes) -> None:
        try:
            self.clips.take(unpack_clip(message))
        except WireError as error:
            self.reply(connection, ErrorMessage(code="unsupported", message=str(error)))
        except ClipError as error:
            self.reply(connection, ErrorMessage(code="clip", message=str(error), where=error.where))

    def spoken(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """The voice's answer to a Speak. Where it failed, the silent voice takes over."""
        if self.closed:
            return
        t = now - self.opened
        self._publish(t)
        if self._tell(t, "spoken", speak, "" if isinstance(result, Utterance) else str(result)):
            self._effects += self.orders.answer(speak, result, t)
            self._work(t)

    def drawn(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """The renderer's answer to a Draw: a picture. Where it failed, pictures end with an error."""
        if self.closed:
            return
        picture = result if isinstance(result, bytes) else None
        effects, lookers = self.broadcast.drawn(draw, picture, self._connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            for connection in lookers:
                for key in [k for k in connection.subscriptions if k[0] == "video"]:
                    del connection.subscriptions[key]
                self.reply(connection.id, ErrorMessage(code="render", message=str(result), where="video"))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Do what is due: feedback, sound and frames first, then read or plan one document at most."""
        if not self.closed and self._work(now - self.opened):
            self._tell(now - self.opened, "tick")

    def pass_time(self, t: float) -> None:
        """Tell what comes due before `t` on the session clock, each at its own time; for who replays it."""
        while (due := self.player.next_deadline()) is not None and due < t and not self.closed:
            self._publish(due)

    def _work(self, t: float) -> bool:
        """What `tick` does; False where nothing came of it but what plays."""
        self._unsettled = False
        self._publish(t)
        self._effects += self.broadcast.due(self._connections.values(), t)
        if self.preparation.waiting:
            self._effects += self.orders.overdue(t + EPSILON)
        # Reading and planning are ticks of their own: the acknowledgement is on its way before planning
        # begins, and frames that are due come in between.
        done = self._submit_ready(t) or self._read_one(t)
        if self.speeches.settle(t) or done:
            self._publish(t)
            return True
        return False

    def next_deadline(self) -> float | None:
        """When `tick` is wanted, on the caller's clock; in the past: at once; None when nothing waits."""
        if self.closed:
            return None
        if self._inbox or self._unsettled or self.speeches.has_next or self.preparation.has_ready:
            return float("-inf")
        deadlines = [
            self.player.next_deadline(),
            self.broadcast.next_deadline(self._connections.values()),
            self.orders.deadline(),
        ]
        known = [d for d in deadlines if d is not None]
        return min(known) + self.opened if known else None

    @property
    def busy(self) -> bool:
        """A block plays, waits or is being prepared."""
        return bool(self._inbox or len(self.preparation) or self.player.next_deadline() is not None)

    def outgoing(self) -> list[Effect]:
        """What the shell has to do, in order; each is told once."""
        effects, self._effects = self._effects, []
        return effects

    # documents ----------------------------------------------------------------------------------

    def _read_one(self, t: float) -> bool:
        """Prepare what comes next in a speech, or in the inbox; False where there is nothing."""
        item = self.speeches.next() or self._inbox.next()
        if isinstance(item, Warning):
            self._refuse(item, t)
        elif item is not None:
            self._prepare(item, t)
        return item is not None

    def _prepare(self, block: Block, t: float) -> None:
        """Ask for the block's voice and acknowledge it; it is planned when nothing is missing."""
        if (fault := self._beyond_limits(block)) is not None:
            self._refuse(Warning(block.id, "CANNOT_CREATE_BEHAVIOR", fault), t, block.character_id)
            return
        try:
            block = self.speeches.placed(block)
            wants = self.player.wants(block)
            character = self.player.character_index(block.character_id)
            waiting = self.preparation.add(block, character, {}, t)
            waiting.lacks, waiting.flows = self.speeches.lacks, self.speeches.flows(block)
            self.player.announce(block, t)
        except Exception:
            self._internal(block, t)
            return
        self._speak(waiting, wants)

    def _submit_ready(self, t: float) -> bool:
        """Plan the first block that waits for nothing; False where all wait."""
        waiting = self.preparation.ready()
        if waiting is None:
            return False
        try:
            waiting.block = self.speeches.placed(waiting.block)
            schedule = self.player.submit(waiting.block, t, waiting.utterances)
            if schedule.lengths and waiting.final:
                # Time has passed while the voice spoke, and it never comes exactly: what is left is little.
                waiting.utterances = warped(waiting.utterances, schedule.lengths)
                schedule = self.player.submit(waiting.block, t, waiting.utterances)
        except Exception:
            self.preparation.remove([waiting])
            self._internal(waiting.block, t)
            return True
        if schedule.lengths:
            self._speak_again(waiting, schedule.lengths, t)
            return True
        self.preparation.remove([waiting])
        if schedule.failed:
            self.speeches.refused(waiting.block.id)
        else:
            self.speeches.planned(waiting.block.id)
        if waiting.block.composition == "REPLACE" and not schedule.failed:
            self.withdraw(self.preparation.replaced_by(waiting), t)
        return True

    def _speak_again(self, waiting: Waiting, lengths: Mapping[str, Mapping[str, float]], t: float) -> None:
        """More of the block fits if its speech lasts so long; what comes back is taken as it is."""
        wants = self.player.wants(waiting.block)
        again = {b: wants[b] for b in self.orders.unfinished(waiting)}
        again |= {b: replace(wants[b], seconds=times["end"]) for b, times in lengths.items()}
        waiting.utterances = {b: as_it_is(u) for b, u in waiting.utterances.items()}
        waiting.since, waiting.final = t, True
        self._speak(waiting, again)

    def _speak(self, waiting: Waiting, wants: Mapping[str, Say]) -> None:
        """Order what a voice has to say."""
        voice = self.voices.get(waiting.character) or self.settings.voice
        chosen = {b: replace(say, voice=say.voice or voice) for b, say in wants.items()}
        self._effects += self.orders.place(waiting, chosen)

    def withdraw(self, gone: list[Waiting], t: float) -> None:
        for waiting in gone:
            self.player.withdraw(waiting.block, t)
            self.speeches.refused(waiting.block.id)
        self.preparation.remove(gone)

    def _beyond_limits(self, block: Block) -> str | None:
        if self.ending:
            return "the service is ending and takes no more documents"
        busy = len(self.preparation) + self.player.alive
        return beyond(block, self.settings, busy, self.player.characters)

    def _internal(self, block: Block, t: float) -> None:
        """A bug: the traceback is ours, the client gets the block's id."""
        log.exception("session %s: block %s failed", self.id, block.id)
        text = "internal error while planning this block"
        self._refuse(Warning(block.id, "EXECUTION_EXCEPTION", text), t, block.character_id)

    def _refuse(self, warning: Warning, t: float, character: str | None = None) -> None:
        self.player.refuse(warning, t, character)
        self.speeches.refused(warning.id)

    # feedback -----------------------------------------------------------------------------------

    def _publish(self, t: float) -> None:
        """Number what is due, keep it, and send it to every connection that has not switched it off."""
        while due := self.player.due(t + EPSILON):
            for feedback in due:
                told, ends = self.speeches.told(feedback)
                self.log.add(told)
                if ends:
                    self.withdraw([w for w in self.preparation.waiting if w.block.id in ends], t)
                    self.player.stop(t, ends)
        for connection in self._connections.values():
            if connection.place <= self.log.newest:
                self._catch_up(connection)

    def _catch_up(self, connection: Connection) -> None:
        if connection.feedback is not None:
            wanted = connection.feedback
            told = self.log.since(connection.place)
            self._effects += [Send(connection.id, text) for feedback, text in told if wanted.takes(feedback)]
        connection.place = self.log.newest + 1

    def resume(self, connection: int, seen: int) -> None:
        """Send what followed `seen`, after a `gap` where some of it is gone or was never there."""
        first = self.log.first
        if seen + 1 < first or seen > self.log.newest:
            self.reply(connection, Gap(seen=seen, first=first))
            seen = first - 1
        self._connections[connection].place = seen + 1
        self._catch_up(self._connections[connection])

    def welcome(self, connection: int, now: float) -> None:
        """Tell a client where it is and what there is."""
        s = self.settings
        limits = Limits(
            message=s.max_message,
            document=s.max_document,
            control=MAX_CONTROL,
            behaviours=s.max_behaviours,
            blocks=s.max_blocks,
            characters=MAX_CHARACTERS,
            connections=s.max_connections,
            picture=s.max_size,
            fps=MAX_FPS,
            keep=s.keep,
        )
        streams = {stream: list(encodings) for stream, encodings in STREAMS.items()}
        reply = Welcome(
            session=self.id,
            time=now - self.opened,
            seq=self.log.newest,
            capabilities=Capabilities(
                streams=streams, pictures=list(PICTURES), fps=s.fps, **self.capabilities
            ),
            limits=limits,
        )
        self.reply(connection, reply)

    def move(self, connection: int, session: str, seen: int | None) -> None:
        """A client asks for another session."""
        self._effects.append(Move(connection, session, seen))

    # characters ---------------------------------------------------------------------------------

    def face_name(self, index: int) -> str:
        from realizer.face import face_name

        return face_name(self.faces.get(index, self.settings.face))

    def face(self, index: int) -> Face:
        return self.load_face(self.face_name(index))

    def mapping(self, index: int) -> FapMapping:
        return mapping_of(self.face_name(index), self.settings.mapping)

    def reply(self, connection: int, reply: Any) -> None:
        self._effects.append(Send(connection, reply.text()))


def _load_face(name: str, deformer: str | None) -> Face:
    from realizer.face import load_face

    return load_face(name, deformer=deformer)
