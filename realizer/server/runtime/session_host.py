"""The host of sessions in an event loop: delivers messages, carries out effects."""

import asyncio
import contextlib
import functools
import itertools
import logging
from collections.abc import Callable, Iterable
from typing import TypeVar

from realizer.core import work
from realizer.core.settings import Settings
from realizer.server.documents.limits import memory
from realizer.server.edits.edit_folder import save
from realizer.server.http.metrics import Metrics
from realizer.server.journal import TakenOver
from realizer.server.runtime.engines import Engines, FairPool
from realizer.server.runtime.gc_policy import GcPolicy
from realizer.server.runtime.session_factory import SessionFactory, SessionRestorer
from realizer.server.runtime.session_registry import (
    ANYBODY,
    JoinError,
    SessionRegistry,
    Visitor,
    worker_of,
)
from realizer.server.runtime.turns import ReadingTurns, SlicedCalls, WakeUps
from realizer.server.session.effects import Close, Draw, Effect, Look, MoveConnection, Send, Speak, Write
from realizer.server.session.session import Session
from realizer.server.streams.connection import SLOW
from realizer.server.transports.transport import Outbound

log = logging.getLogger(__name__)

E = TypeVar("E", Speak, Draw, Look, Write)
R = TypeVar("R")

DRAIN_STEP = 0.05  # s; how often `drain` checks whether everything has ended
FRAME_SLICES = 5  # of time; frames that take longer to compute are continued with the documents, in turn
MOST_WAITING = 100  # messages to a session that plans; then its clients are read more slowly
CONGESTION = 0.02  # s; how often a client looks whether its session can take messages again
SLOW_STEP = 0.05  # s; a step of the loop that takes so long is logged
DEGRADED = "degraded"  # status of `/healthz` while the process is overloaded
EXPIRY_INTERVAL = 5.0  # s; how often expired sessions and due checkpoints are looked for


class SessionHost:
    """All sessions of the service with their timers and engines, in an event loop.

    Transports let their clients `join`, pass on messages by the number that this returns, and `leave`. What a
    session sends goes to the `Outbound` that joined.

    Args:
        worker: number of this process among `settings.workers`; None if it is the only one.
    """

    def __init__(self, settings: Settings, worker: int | None = None) -> None:
        self.settings = settings

        def is_local(session: str) -> bool:
            if self._factory.journal is not None and not self._restorer.is_live(session):
                return False  # another process may have it; only `restore`, before `join`, finds out
            return worker is None or worker_of(session, settings.workers, settings) == worker

        self.metrics = Metrics(worker)
        self._factory = SessionFactory(settings, self.metrics)
        self._overload = self._factory.overload
        self._registry = SessionRegistry(
            self._factory.new,
            settings,
            is_local,
            self._call,
            lambda session: self._calls.cancel(session),
            self._overload,
        )
        self._engines = Engines(settings.deformer)
        self._clients: dict[int, Outbound] = {}
        self._numbers = itertools.count(1)
        self._expiry_timer: asyncio.TimerHandle | None = None
        self._gc_policy = GcPolicy()
        self._closed = False
        self._takeover_check: asyncio.Task[None] | None = None
        self._restorer = SessionRestorer(
            self._factory, self._engines, self._registry.sessions, settings.keep, self._call, self._adopt
        )

    async def start(self) -> None:
        """Load what all sessions share.

        Raises:
            ValueError: the scene file is not a scene.
            FaceError: there is no such face.
            TableError: the mapping, or a user's expression, cannot be used.
            JournalError: the journal cannot be opened.
        """
        self._loop = asyncio.get_running_loop()
        self._wake_ups = WakeUps[Session](self._loop, self._wake)
        self._reading = ReadingTurns[Session](
            self._loop, self._read, lambda: self._overload.is_active and self._wake_ups.is_behind
        )
        self._calls = SlicedCalls[Session](self._reading.add, self._loop.call_soon_threadsafe)
        await self._factory.load()
        self._expiry_timer = self._loop.call_later(EXPIRY_INTERVAL, self._expire_sessions)

    def stop_accepting(self) -> None:
        """Refuse documents from now on."""
        self._factory.ending = True
        for session in self._registry.sessions.values():
            session.inbox.ending = True

    async def drain(self) -> None:
        """Wait at most `settings.drain` seconds for what plays."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(self.settings.drain):
                while self.busy:
                    await asyncio.sleep(DRAIN_STEP)

    @property
    def busy(self) -> bool:
        """Whether a block plays, waits or is being prepared."""
        sessions = self._registry.sessions.values()
        return any(self._calls.is_busy(session) or session.busy for session in sessions)

    async def close(self) -> None:
        """End every session and every engine."""
        self._closed = True
        self._reading.close()
        self._wake_ups.close()
        for task in (self._expiry_timer, self._takeover_check):
            if task is not None:
                task.cancel()
        for session in self._registry.sessions.values():
            session.close()
        self._calls.close()
        self._factory.close()
        await self._loop.run_in_executor(None, self._engines.close)

    def health(self) -> dict[str, object]:
        """Return what `/healthz` reports beside the status."""
        status = {"status": DEGRADED} if self._overload.is_active else {}
        return {**status, "sessions": len(self._registry.sessions), "connections": len(self._clients)}

    def metrics_text(self) -> str:
        """Return the metrics in the Prometheus text format."""
        sessions = self._registry.sessions.values()
        dropped = sum(client.dropped for session in sessions for client in session.connections.values())
        return self.metrics.text(
            {
                "sessions": len(sessions),
                "connections": len(self._clients),
                "blocks_waiting": sum(len(session.submission.pending) for session in sessions),
                "blocks_playing": sum(len(session.player.blocks.active()) for session in sessions),
                "unsent_bytes": sum(client.unsent_bytes for client in self._clients.values()),
                "memory_bytes": memory(),
                "overloaded": self._overload.is_active,
            },
            {"frames_dropped": dropped},
        )

    # connections --------------------------------------------------------------------------------

    def check(self, name: str | None, visitor: Visitor = ANYBODY) -> None:
        """Check whether a client may join. Raises as `SessionRegistry.check`."""
        self._registry.check(name, visitor)

    async def restore(self, name: str | None, seen: int | None = None) -> None:
        """Take over a session of another process; raises as `SessionRestorer.restore`."""
        await self._restorer.restore(name, seen)

    def _adopt(self, session: Session, unanswered: Iterable[Effect]) -> None:
        self._run(session, unanswered)
        self._apply_effects(session)

    def join(
        self, client: Outbound, name: str | None = None, seen: int | None = None, visitor: Visitor = ANYBODY
    ) -> int:
        """Add a client to the named session, or to a new one, and return the number of its connection.

        Raises:
            JoinError: as `check`.
        """
        number = next(self._numbers)
        self._clients[number] = client
        try:
            self._registry.open(number, name, self._loop.time(), seen, visitor)
        except JoinError:
            del self._clients[number]
            raise
        return number

    def receive(self, number: int, message: str | bytes) -> bool:
        """Pass on a message of a connection. Return False if it is in no session any more."""
        session = self._registry.session_of.get(number)
        if session is None or session.closed:
            return False
        self.metrics.counts["messages"] += 1
        began = self._loop.time()
        self._call(session, functools.partial(self._receive, session, number, message))
        self._report_slow_step(began, f"a message of {len(message)} characters", session, [number])
        return True

    def is_congested(self, number: int) -> bool:
        """Return whether so many messages of a connection's session wait that no more should be read."""
        session = self._registry.session_of.get(number)
        return session is not None and self._calls.count_waiting(session) >= MOST_WAITING

    async def wait_for_room(self, number: int) -> None:
        """Wait while a connection's session is congested."""
        while self.is_congested(number):
            await asyncio.sleep(CONGESTION)

    def _receive(self, session: Session, number: int, message: str | bytes) -> None:
        if (present := self._registry.session_of.get(number)) is not session and present is not None:
            self.receive(number, message)  # it has moved while the message waited
            return
        # A client that only asks and never reads must be noticed here: nothing else may ever be due.
        self._update_backlog(session, number)
        session.receive(number, message, self._loop.time())

    def _update_backlog(self, session: Session, *numbers: int) -> None:
        for number in numbers:
            if (client := self._clients.get(number)) is not None:
                session.update_backlog(number, client.unsent_bytes)

    def leave(self, number: int) -> None:
        """Remove a closed connection."""
        left = self._registry.session_of.get(number)
        if left is not None:
            self.metrics.counts["frames_dropped"] += left.connections.dropped_count(number)
        self._registry.leave(number, self._loop.time())
        self._clients.pop(number, None)
        self._gc_policy.ended_connections += 1

    # sessions -----------------------------------------------------------------------------------

    def oldest_in_use(self, ignored: type) -> str | None:
        """Return the name of the oldest session with a client of another class than `ignored`, or None."""
        for name, session in self._registry.sessions.items():
            numbers = self._registry.joined(session)
            if not session.closed and any(not isinstance(self._clients[k], ignored) for k in numbers):
                return name
        return None

    def end(self, name: str) -> bool:
        """End a session and close its connections. Return False if there is none of that name."""
        session = self._registry.sessions.get(name)
        if session is None:
            return False
        self._end(session, 1000, "the session was ended")
        return True

    def _end(self, session: Session, code: int, reason: str) -> None:
        numbers = self._registry.joined(session)
        self._run(session, [Close(number, code, reason) for number in numbers])
        self._registry.end(session)
        self._apply_effects(session)

    def _call(self, session: Session, function: Callable[[], None]) -> bool:
        """Call a function that changes a session, and carry out the effects.

        If it takes long, or if other calls of the session have not ended, it ends later.

        Returns:
            Whether it has ended.
        """

        def step() -> None:
            try:
                function()
            except Exception:
                self._fail(session)
            self._apply_effects(session)

        self._calls.call(session, step)
        return not self._calls.is_busy(session)

    def _apply_effects(self, session: Session) -> None:
        effects = session.take_effects()
        if any(isinstance(effect, MoveConnection) for effect in effects):
            effects = self._registry.move_connections(session, effects, self._loop.time())
        self._run(session, effects)
        if session.closed:
            self._engines.drop(session)
        self._schedule_wakeup(session)

    def _run(self, session: Session, effects: Iterable[Effect]) -> None:
        engines = self._engines
        for effect in work.counted(effects, 5):
            match effect:
                case Send(connection, data):
                    if (client := self._clients.get(connection)) is not None:
                        client.send(data)
                case Speak():
                    self._submit(session, engines.speech_pool, engines.speak, effect, session.on_speech)
                case Draw():
                    self._submit(session, engines.render_pool, engines.draw, effect, session.on_picture)
                case Look():
                    self._submit(session, engines.tracking_pool, engines.look, effect, session.on_sight)
                case Write():
                    self._submit(session, engines.file_pool, save, effect, session.on_saved)
                case Close(connection, code, reason):
                    if (client := self._clients.get(connection)) is not None:
                        client.disconnect(code, reason)

    def _submit(
        self,
        session: Session,
        pool: FairPool,
        compute: Callable[[E], R],
        effect: E,
        take: Callable[[int, R, float], None],
    ) -> None:
        def answer(future: asyncio.Future[R]) -> None:
            if not future.cancelled():
                result = future.result()
                self._deliver(session, lambda: take(effect.id, result, self._loop.time()))

        computed = pool.submit(session, functools.partial(compute, effect))
        asyncio.wrap_future(computed, loop=self._loop).add_done_callback(answer)

    def _schedule_wakeup(self, session: Session) -> None:
        """Schedule the next wake-up of a session, and its next document, which waits for its turn."""
        if self._closed:
            return
        self._wake_ups.set(session, session.next_due())
        if session.has_documents:
            self._reading.add(session)

    def _wake(self, session: Session, when: float) -> None:
        began = self._loop.time()
        self._tick(session, when)
        self._report_slow_step(began, "frames and feedback", session)

    def _tick(self, session: Session, when: float) -> None:
        """Send the frames and the feedback of a session that are due, and do what else is."""
        now = self._loop.time()
        self.metrics.late.pending.append(now - when)
        self._overload.note(now - when, now)
        if self._calls.is_busy(session):
            return  # it is woken again when its call has ended
        self._calls.call(session, functools.partial(self._send_due, session, now), FRAME_SLICES)

    def _send_due(self, session: Session, now: float) -> None:
        try:
            frames = session.frames(now)
        except Exception:
            self._fail(session)
            return
        if frames is None:
            self._call(session, functools.partial(self._work, session, now, read_documents=False))
            return
        effects, due = frames
        self._run(session, effects)
        for number in session.connections:
            client = self._clients.get(number)
            if client is not None and (waiting := client.unsent_bytes) > SLOW:
                session.update_backlog(number, waiting)
        self._wake_ups.set(session, due)

    def _read(self, session: Session) -> None:
        """Continue a paused call of a session, or read its next document."""
        began = self._loop.time()
        if self._calls.is_busy(session):
            self._calls.resume(session)
        elif not session.closed:
            self._call(session, functools.partial(self._read_document, session, began))
        self._report_slow_step(began, "a document", session)

    def _read_document(self, session: Session, now: float) -> None:
        plans = session.player.version
        self._work(session, now, read_documents=True)
        if session.player.version != plans:
            self.metrics.planning.pending.append(self._loop.time() - now)

    def _work(self, session: Session, now: float, *, read_documents: bool) -> None:
        self._update_backlog(session, *session.connections)
        session.tick(now, read_documents=read_documents)

    def _report_slow_step(
        self, began: float, action: str, session: Session, connections: Iterable[int] | None = None
    ) -> None:
        """Report a step of the loop if it took so long that it delayed the frames of all clients."""
        seconds = self._loop.time() - began
        if seconds >= SLOW_STEP:
            clients = list(session.connections if connections is None else connections)
            self.metrics.report_slow_step(seconds, action, session.id, clients)

    def _fail(self, session: Session) -> None:
        log.exception("session %s ends: it failed", session.id)
        self.metrics.counts["failures"] += 1
        self._end(session, 1011, "internal error")  # in the journal, too: a restored session would fail again

    def _deliver(self, session: Session, answer: Callable[[], None]) -> None:
        if not self._closed:
            began = self._loop.time()
            self._call(session, answer)
            self._report_slow_step(began, "the result of a voice or a renderer", session)

    def _compact_journal(self, session: Session) -> None:
        if self._closed:
            return
        began = self._loop.time()
        self._call(session, lambda: session.compact_journal(self._loop.time()))
        self._report_slow_step(began, "a checkpoint of the journal", session)

    async def _check_takeovers(self) -> None:
        for session in await self._factory.taken_over(self._registry.sessions.values()):
            self._calls.cancel(session)
            waiting = self._registry.joined(session).difference(session.connections)
            session.hand_over(error := TakenOver(session.id))
            self._apply_effects(session)
            self._run(session, [Close(number, 1012, str(error)) for number in waiting])

    def _expire_sessions(self) -> None:
        self._gc_policy.collect_if_needed(len(self._clients))
        for histogram in (self.metrics.late, self.metrics.planning, self.metrics.slow_steps):
            histogram.count()
        now = self._loop.time()
        self._overload.end_if_over(now)
        self._registry.remove_expired(now)
        self._restorer.expire(now)
        # Spread the checkpoints over the time until the next call.
        grown = [
            session for session in self._registry.sessions.values() if session.journal.writer.needs_checkpoint
        ]
        for k, session in enumerate(grown):
            self._loop.call_later(EXPIRY_INTERVAL * k / len(grown), self._compact_journal, session)
        if self._takeover_check is None or self._takeover_check.done():
            self._takeover_check = self._loop.create_task(self._check_takeovers())
        self._expiry_timer = self._loop.call_later(EXPIRY_INTERVAL, self._expire_sessions)
