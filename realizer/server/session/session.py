"""One session: documents and control messages in, effects out. No sockets, no clock: it is told `now`."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from realizer.behaviours.kind import Position
from realizer.behaviours.registry import KINDS
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.protocol.messages.replies import ErrorMessage, Gap
from realizer.server.documents.limits import too_long
from realizer.server.documents.submission import Intake
from realizer.server.journal import Lost
from realizer.server.journal.checkpoint import checkpoint
from realizer.server.journal.entry import Kind
from realizer.server.journal.journal_writer import Notes
from realizer.server.session.character_faces import Faces
from realizer.server.session.dispatch import take
from realizer.server.session.effects import Close, Effect, Move, Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.feedback_publisher import Telling
from realizer.server.session.wakeup_plan import Rhythm
from realizer.server.session.welcome import greeting
from realizer.server.speech.audio_clips import Clips
from realizer.server.streams.broadcast import Broadcast
from realizer.server.streams.connection import STUCK, Connection, PictureSubscription, Subscription, View
from realizer.server.streams.frame_fast_path import Run
from realizer.server.streams.frame_windows import EPSILON
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)


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

    Attributes:
        ending: no more documents are taken.

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
            kinds=KINDS,
            scene=scene,
            seed=settings.seed,
            idle=settings.idle,
            language=settings.language,
            media=settings.media,
            clips=self.clips.recordings,
            expressions=settings.expressions,
            cooccurrence=settings.cooccurrence,
            prosody=settings.prosody,
            takes=lambda index: self.faces.of(index).takes,
            refuses=lambda block, schedule: too_long(block, schedule, settings),
        )
        self.capabilities = dict(capabilities or {})
        self.broadcast = Broadcast(self.player, self.faces)
        self.intake = Intake(id, settings, self.player, self._owe)
        self._connections: dict[int, Connection] = {}
        self.telling = Telling(self.player, self.intake, epoch)
        self._effects: list[Effect] = []
        self._rhythm = Rhythm(self.player, self.intake, self.broadcast, self._connections)

    # connections --------------------------------------------------------------------------------

    @property
    def log(self) -> FeedbackLog:
        """What it has told."""
        return self.telling.log

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

    def views(self, but: Subscription | None = None) -> list[View]:
        """The pictures that are drawn for its connections, each once; without those of one subscription."""
        subscriptions = [s for c in self._connections.values() for s in c.subscriptions.values()]
        looking = [s for s in subscriptions if isinstance(s, PictureSubscription) and s is not but]
        return list({s.view.key: s.view for s in looking}.values())

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
            known.backlog = waiting
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
        self._effects += self.broadcast.frames_due(t)[0]
        if self.notes.grown and not self._compact(t):
            return
        kept = take(self, self._connections[connection], message, t)
        if not self.closed and self._work(t) and not kept:
            self.note(t, "tick")

    def note(self, t: float, kind: Kind, number: int = 0, body: str = "") -> bool:
        """Write into the journal what has happened; False where the session is another process's now."""
        try:
            self.notes.tell(t, kind, number, body)
        except Lost as error:
            self.lose(error)
            return False
        return True

    def _compact(self, t: float) -> bool:
        """Let the journal begin anew where nothing plays; False where another process has the session."""
        try:
            checkpoint(self, t)
        except Lost as error:
            self.lose(error)
            return False
        return True

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
            plans = self.player.revision
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
        """Tell all that is due to everybody who has not switched it off."""
        self._effects += self.telling.publish(t, self._connections.values())

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
        self._effects += self.telling.catch_up(known)

    def welcome(self, connection: int, now: float) -> None:
        """Tell a client where it is and what there is."""
        self.reply(connection, greeting(self, now - self.opened))

    def move(self, connection: int, session: str, seen: int | None) -> None:
        """A client asks for another session."""
        self._effects.append(Move(connection, session, seen))

    def reply(self, connection: int, reply: Any) -> None:
        if not self.closed:
            self._effects.append(Send(connection, reply.text()))
