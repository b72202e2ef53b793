"""The runner of sessions in an event loop: delivers messages, wakes sessions, carries out their effects."""

import asyncio
import itertools
import logging
from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

from realizer.core import work
from realizer.core.settings import Settings
from realizer.core.work import FairPool
from realizer.server.http.metrics import Metrics
from realizer.server.runtime.edit_folder import save
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.session_registry import ANYBODY, JoinError, SessionRegistry, Visitor
from realizer.server.runtime.turns import ReadingTurns, SlicedCalls, WakeUps
from realizer.server.session.connections import SLOW
from realizer.server.session.effects import Close, Draw, Effect, Look, MoveConnection, Send, Speak, Write
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import Overload
from realizer.server.transports.transport import Outbound

log = logging.getLogger(__name__)

E = TypeVar("E", Speak, Draw, Look, Write)
R = TypeVar("R")

FRAME_SLICES = 5  # of time; frames that take longer to compute are continued with the documents, in turn
MOST_WAITING = 100  # messages to a session that plans; then its clients are read more slowly
CONGESTION = 0.02  # s; how often a client looks whether its session can take messages again
SLOW_STEP = 0.05  # s; a step of the loop that takes so long is logged


class SessionRunner:
    """Sessions that run in an event loop, with their timers and engines.

    Transports let their clients `join`, pass on messages by the number that this returns, and `leave`. What a
    session sends goes to the `Outbound` that joined.

    Args:
        make: makes a session; as `SessionRegistry` calls it.
        is_local: as for `SessionRegistry`.
    """

    def __init__(
        self,
        settings: Settings,
        metrics: Metrics,
        overload: Overload,
        make: Callable[[str, float, bool], Session],
        is_local: Callable[[str], bool],
    ) -> None:
        self.settings = settings
        self.metrics = metrics
        self._overload = overload
        self._registry = SessionRegistry(
            make, settings, is_local, self._call, lambda session: self._calls.cancel(session), overload
        )
        self._engines = Engines(settings.deformer)
        self._clients: dict[int, Outbound] = {}
        self._numbers = itertools.count(1)
        self._closed = False

    async def start(self) -> None:
        """Begin to run sessions in the present event loop."""
        self._loop = asyncio.get_running_loop()
        self._wake_ups = WakeUps[Session](self._loop, self._wake)
        self._reading = ReadingTurns[Session](
            self._loop, self._read, lambda: self._overload.is_active and self._wake_ups.is_behind
        )
        self._calls = SlicedCalls[Session](self._reading.add, self._loop.call_soon_threadsafe)

    async def close(self) -> None:
        """End every session and every engine."""
        self._closed = True
        self._reading.close()
        self._wake_ups.close()
        for session in self._registry.sessions.values():
            session.close()
        self._calls.close()
        await self._loop.run_in_executor(None, self._engines.close)

    # connections --------------------------------------------------------------------------------

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
        self._call(session, partial(self._receive, session, number, message))
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
        if left is not None and (connection := left.connections.get(number)) is not None:
            self.metrics.counts["frames_dropped"] += connection.dropped
        self._registry.leave(number, self._loop.time())
        self._clients.pop(number, None)

    def _end(self, session: Session, code: int, reason: str) -> None:
        numbers = self._registry.joined(session)
        self._run(session, [Close(number, code, reason) for number in numbers])
        self._registry.end(session)
        self._apply_effects(session)

    # calls and effects --------------------------------------------------------------------------

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
                    self._submit(
                        session,
                        engines.file_pool,
                        save,
                        effect,
                        lambda id, reply, now: session.connections.reply(id, reply),
                    )
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

        computed = pool.submit(session, partial(compute, effect))
        asyncio.wrap_future(computed, loop=self._loop).add_done_callback(answer)

    # time ---------------------------------------------------------------------------------------

    def _schedule_wakeup(self, session: Session) -> None:
        """Schedule the next wake-up of a session, and its next document, which waits for its turn."""
        if self._closed:
            return
        self._wake_ups.set(session, session.next_due())
        if session.has_documents:
            self._reading.add(session)

    def _wake(self, session: Session, when: float) -> None:
        """Send the frames and the feedback of a session that are due, and do what else is."""
        now = self._loop.time()
        self.metrics.late.observe(now - when)
        self._overload.note(now - when, now)
        if not self._calls.is_busy(session):  # else it is woken again when its call has ended
            self._calls.call(session, partial(self._send_due, session, now), FRAME_SLICES)
        self._report_slow_step(now, "frames and feedback", session)

    def _send_due(self, session: Session, now: float) -> None:
        try:
            due = session.ticker.send_ready(session.clock.read(now))
        except Exception:
            self._fail(session)
            return
        if due is None:
            self._call(session, partial(self._work, session, now, read_documents=False))
            return
        self._run(session, session.take_effects())
        for number in session.connections:
            client = self._clients.get(number)
            if client is not None and (waiting := client.unsent_bytes) > SLOW:
                session.update_backlog(number, waiting)
        self._wake_ups.set(session, due + session.clock.opened)

    def _read(self, session: Session) -> None:
        """Continue a paused call of a session, or read its next document."""
        began = self._loop.time()
        if self._calls.is_busy(session):
            self._calls.resume(session)
        elif not session.closed:
            self._call(session, partial(self._read_document, session, began))
        self._report_slow_step(began, "a document", session)

    def _read_document(self, session: Session, now: float) -> None:
        plans = session.player.version
        self._work(session, now, read_documents=True)
        if session.player.version != plans:
            self.metrics.planning.observe(self._loop.time() - now)

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
