"""The host of sessions in an event loop: delivers messages, carries out effects."""

from __future__ import annotations

import asyncio
import functools
import itertools
import logging
from typing import Any

from realizer.core.settings import Settings
from realizer.server.documents.limits import memory
from realizer.server.http.metrics import Metrics
from realizer.server.journal import Journal, TakenOver
from realizer.server.journal.replay import catch_up
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.gc_policy import GcPolicy
from realizer.server.runtime.session_factory import SessionFactory
from realizer.server.runtime.session_registry import ANYBODY, SessionRegistry, Visitor, worker_of
from realizer.server.runtime.takeovers import taken_over
from realizer.server.runtime.timer_wheel import TimerWheel
from realizer.server.session.effects import Close, Draw, Effect, Send, Speak
from realizer.server.session.session import Session
from realizer.server.streams.connection import SLOW
from realizer.server.transports.transport import Outbound

log = logging.getLogger(__name__)

# How often sessions that nobody visits are looked for.
EXPIRY_INTERVAL = 5.0  # s


class SessionHost:
    """All sessions of the service with their timers and engines. Doors let their clients `join` here.

    It is told what comes from a connection by the number that `join` gave, and hands what goes to it to the
    Client that joined.

    Args:
        worker: the number of this process among `settings.workers`; None where it is the only one.
    """

    def __init__(self, settings: Settings, worker: int | None = None) -> None:
        self.settings = settings

        def ours(session: str) -> bool:
            if self._factory.journal is not None and not self._is_live(session):
                return False  # another process may have it: only `restore` asks, before somebody joins
            return worker is None or worker_of(session, settings.workers, settings) == worker

        self.metrics = Metrics(worker)
        self._factory = SessionFactory(settings, self.metrics)
        self._registry = SessionRegistry(self._factory.new, settings, ours)
        self._engines = Engines(settings.deformer)
        self._clients: dict[int, Outbound] = {}
        self._reading: dict[Session, None] = {}  # those with documents to read or plan, in turn
        self._numbers = itertools.count(1)
        self._expiry_timer: asyncio.TimerHandle | None = None
        self._gc_policy = GcPolicy()
        self._closed = False
        self._takeover_check: asyncio.Task[None] | None = None
        self._restoring: dict[str, asyncio.Task[None]] = {}
        self._taken_over: dict[str, float] = {}  # session -> until when clients come back to it; loop time

    async def start(self) -> None:
        """Load what every session shares.

        Raises:
            ValueError: the scene file is not a scene.
            FaceError: no such face.
            TableError: a mapping, or an expression of one's own, that cannot be used.
            JournalError: a journal that cannot be had.
        """
        self._loop = asyncio.get_running_loop()
        self._timers = TimerWheel(self._loop, self._tick)
        await self._factory.load()
        self._expiry_timer = self._loop.call_later(EXPIRY_INTERVAL, self._expire_sessions)

    def stop_accepting(self) -> None:
        """Sessions take no more documents from now on."""
        self._factory.ending = True
        for session in self._registry.sessions.values():
            session.ending = True

    @property
    def busy(self) -> bool:
        """Something plays, waits or is being prepared."""
        return any(session.busy for session in self._registry.sessions.values())

    async def close(self) -> None:
        """End every session and every engine."""
        self._closed = True
        self._timers.close()
        self._reading.clear()
        for waiting in (self._expiry_timer, self._takeover_check):
            if waiting is not None:
                waiting.cancel()
        for session in self._registry.sessions.values():
            session.close()
        self._factory.close()
        await self._loop.run_in_executor(None, self._engines.close)

    def health(self) -> dict[str, object]:
        """How many there are."""
        return {"sessions": len(self._registry.sessions), "connections": len(self._clients)}

    def metrics_text(self) -> str:
        """What Prometheus reads."""
        sessions = self._registry.sessions.values()
        dropped = sum(session.dropped_count(number) for session in sessions for number in session.connections)
        return self.metrics.text(
            {
                "sessions": len(sessions),
                "connections": len(self._clients),
                "blocks_waiting": sum(len(session.submission.pending) for session in sessions),
                "blocks_playing": sum(session.player.active_count for session in sessions),
                "unsent_bytes": sum(client.unsent_bytes for client in self._clients.values()),
                "memory_bytes": memory(),
            },
            {"frames_dropped": dropped},
        )

    # connections --------------------------------------------------------------------------------

    def check(self, name: str | None, visitor: Visitor = ANYBODY) -> None:
        """Whether a client could join.

        Raises:
            HubError: a bad name, one that is not for it, or too many sessions.
        """
        self._registry.check(name, visitor)

    async def restore(self, name: str | None, seen: int | None = None) -> None:
        """Go on with a session that another process has had, before somebody joins it.

        Args:
            seen: seq of the feedback that who comes had last: the session has come at least so far.

        Raises:
            JournalError: the journal cannot be read.
        """
        if self._factory.journal is None or name is None:
            return
        if not self._is_live(name):
            if name not in self._restoring:
                self._restoring[name] = self._loop.create_task(self._restore(name, seen or 0))
            await asyncio.shield(self._restoring[name])
        session = self._registry.sessions.get(name)
        if session is not None and name in self._taken_over and session.feedback_log.newest < (seen or 0):
            now = self._loop.time()
            session.opened -= catch_up(session, now, seen or 0) - now
            self._apply_effects(session)

    def _is_live(self, name: str) -> bool:
        """A session of that name is here; one that another process has may only still be known."""
        known = self._registry.sessions.get(name)
        return known is not None and not known.closed

    async def _restore(self, name: str, seen: int) -> None:
        try:
            found = await self._factory.restore(name, seen, self._engines.speak)
            if found is None:
                return
            session, owed = found
            self._registry.sessions[name] = session
            self._taken_over[name] = self._loop.time() + self.settings.keep
            for effect in owed:
                self._apply_effect(session, effect)
            self._apply_effects(session)
        finally:
            del self._restoring[name]

    def join(
        self,
        client: Outbound,
        name: str | None = None,
        seen: int | None = None,
        visitor: Visitor = ANYBODY,
    ) -> int:
        """Let a client into the session of that name, or into one of its own; its number from now on.

        Raises:
            HubError: as `check`.
        """
        number = next(self._numbers)
        session = self._registry.open(number, name, self._loop.time(), seen, visitor)
        self._clients[number] = client
        self._apply_effects(session)
        return number

    def receive(self, number: int, message: str | bytes) -> bool:
        """A message from a connection; False where it is in no session any more."""
        session = self._registry.session_of(number)
        if session is None or session.closed:
            return False
        self.metrics.counts["messages"] += 1
        try:
            # Who asks and never reads the answers is found here: nothing else may ever be due.
            session.update_backlog(number, self._clients[number].unsent_bytes)
            session.receive(number, message, self._loop.time())
        except Exception:
            self._fail(session)
        self._apply_effects(session)
        return True

    def leave(self, number: int) -> None:
        """A connection is gone."""
        left = self._registry.session_of(number)
        if left is not None:
            self.metrics.counts["frames_dropped"] += left.dropped_count(number)
        self._registry.leave(number, self._loop.time())
        self._clients.pop(number, None)
        self._gc_policy.ended_connections += 1
        if left is not None:
            self._schedule_wakeup(left)

    # sessions -----------------------------------------------------------------------------------

    def _apply_effects(self, session: Session) -> None:
        """Do what a session wants done, then wake it when it next has something."""
        for effect in self._registry.take_effects(session, self._loop.time()):
            self._apply_effect(session, effect)
        self._schedule_wakeup(session)

    def _schedule_wakeup(self, session: Session) -> None:
        """Wake it when something is due; what it has to read waits for its turn."""
        if self._closed:
            return
        self._timers.schedule(session, session.next_due())
        if session.has_documents:
            if not self._reading:
                self._loop.call_soon(self._read)
            self._reading.setdefault(session)

    def _tick(self, session: Session, when: float) -> None:
        """Frames, feedback and whatever else is due."""
        now = self._loop.time()
        self.metrics.late.observe(now - when)
        run = session.fast_path
        if run is not None and (data := run.next_message(now)) is not None:
            client = self._clients[run.connection]
            client.send(data)
            if (waiting := client.unsent_bytes) > SLOW:
                session.update_backlog(run.connection, waiting)
            self._timers.schedule(session, run.wake_at)
            return
        try:
            found = session.frames(now)
        except Exception:
            self._fail(session)
            return
        if found is None:
            self._work(session, now, read_documents=False)
            return
        effects, due = found
        for effect in effects:
            self._apply_effect(session, effect)
        for number in session.connections:
            if (waiting := self._clients[number].unsent_bytes) > SLOW:
                session.update_backlog(number, waiting)
        self._timers.schedule(session, due)

    def _read(self) -> None:
        """Read or plan one document of one session; whatever is due in others comes before the next."""
        if not self._reading:
            return
        session = next(iter(self._reading))
        del self._reading[session]
        if self._reading:
            self._loop.call_soon(self._read)
        began, plans = self._loop.time(), session.player.version
        self._work(session, began, read_documents=True)
        if session.player.version != plans:
            self.metrics.planning.observe(self._loop.time() - began)

    def _work(self, session: Session, now: float, *, read_documents: bool) -> None:
        for number in session.connections:
            session.update_backlog(number, self._clients[number].unsent_bytes)
        try:
            session.tick(now, read_documents=read_documents)
        except Exception:
            self._fail(session)
        self._apply_effects(session)

    def _fail(self, session: Session) -> None:
        """A bug: the traceback is ours, this session ends, the others play on."""
        log.exception("session %s ends: it failed", session.id)
        self.metrics.counts["failures"] += 1
        for number in session.connections:
            self._apply_effect(session, Close(number, 1011, "internal error"))
        session.close()
        session.journal.end()  # who does the same again from the journal would fail again
        self._registry.remove(session)

    def _apply_effect(self, session: Session, effect: Effect) -> None:
        match effect:
            case Send(connection, data):
                if (client := self._clients.get(connection)) is not None:
                    client.send(data)
            case Speak(id):
                future = self._loop.run_in_executor(self._engines.speech_pool, self._engines.speak, effect)
                future.add_done_callback(
                    functools.partial(self._deliver_result, session, session.on_speech, id)
                )
            case Draw(id):
                drawing = self._loop.run_in_executor(self._engines.render_pool, self._engines.draw, effect)
                drawing.add_done_callback(
                    functools.partial(self._deliver_result, session, session.on_picture, id)
                )
            case Close(connection, code, reason):
                if (client := self._clients.get(connection)) is not None:
                    client.disconnect(code, reason)

    def _deliver_result(self, session: Session, tell: Any, id: int, future: asyncio.Future[Any]) -> None:
        if not future.cancelled() and not self._closed:
            tell(id, future.result(), self._loop.time())
            self._apply_effects(session)

    def _compact_journal(self, session: Session) -> None:
        if self._closed:
            return
        try:
            session.compact_journal(self._loop.time())
        except Exception:
            self._fail(session)
        self._apply_effects(session)

    async def _check_takeovers(self, journal: Journal) -> None:
        """Let go of who watches a session that plays elsewhere now."""
        for session in await taken_over(journal, self._registry.sessions.values()):
            session.hand_over(TakenOver(f"session {session.id} is another process's now"))
            self._apply_effects(session)

    def _expire_sessions(self) -> None:
        self._gc_policy.collect_if_needed(len(self._clients))
        now = self._loop.time()
        self._registry.remove_expired(now)
        self._taken_over = {name: end for name, end in self._taken_over.items() if end > now}
        # What is written for all of them is written one after the other, until the next sweep.
        grown = [session for session in self._registry.sessions.values() if session.journal.needs_checkpoint]
        for place, session in enumerate(grown):
            self._loop.call_later(EXPIRY_INTERVAL * place / len(grown), self._compact_journal, session)
        if self._factory.journal is not None and (
            self._takeover_check is None or self._takeover_check.done()
        ):
            self._takeover_check = self._loop.create_task(self._check_takeovers(self._factory.journal))
        self._expiry_timer = self._loop.call_later(EXPIRY_INTERVAL, self._expire_sessions)
