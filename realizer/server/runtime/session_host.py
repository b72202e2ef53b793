"""The host of all sessions of the service: clients join, sessions are opened, restored and ended."""

import asyncio
import contextlib
import itertools
import logging
import secrets
from functools import partial

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.documents.limits import memory
from realizer.server.http.metrics import Metrics
from realizer.server.journal import TakenOver
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.garbage import GcPolicy
from realizer.server.runtime.session_factory import SessionFactory
from realizer.server.runtime.session_loop import SessionLoop
from realizer.server.runtime.session_registry import (
    ANYBODY,
    JoinError,
    SessionRegistry,
    Visitor,
    worker_of,
)
from realizer.server.session.effects import Close, Send
from realizer.server.session.session import Session
from realizer.server.transports.transport import Outbound

log = logging.getLogger(__name__)

DRAIN_STEP = 0.05  # s; how often `drain` checks whether everything has ended
DEGRADED = "degraded"  # status of `/healthz` while the process is overloaded
EXPIRY_INTERVAL = 5.0  # s; how often expired sessions and due checkpoints are looked for
MOST_WAITING = 100  # messages to a session that plans; then its clients are read more slowly
FAILING, MOST_FAILURES = 10.0, 5  # s; a session that fails more often in that time ends
CONGESTION = 0.02  # s; how often a client looks whether its session can take messages again


class SessionHost:
    """All sessions of the service.

    Transports let their clients `join`, pass on messages by the number that this returns, and `leave`. What a
    session sends goes to the `Outbound` that joined.

    Args:
        worker: number of this process among `settings.workers`; None if it is the only one.
    """

    def __init__(self, settings: Settings, worker: int | None = None) -> None:
        def is_local(session: str) -> bool:
            if self._factory.journal is not None and not self._is_live(session):
                return False  # another process may have it; only `restore`, before `join`, finds out
            return worker is None or worker_of(session, settings.workers, settings) == worker

        self.settings = settings
        self.metrics = Metrics(worker)
        self._factory = SessionFactory(settings, self.metrics)
        self._overload = self._factory.overload
        self._clients: dict[int, Outbound] = {}
        self._numbers = itertools.count(1)
        self._loop = SessionLoop(
            Engines(settings.deformer),
            self._clients,
            self.metrics,
            self._overload,
            lambda *move: self._registry.move_connections(*move),
            self._fail,
        )
        self._registry = SessionRegistry(
            self._factory.new, settings, is_local, self._loop.call, self._loop.cancel, self._overload
        )
        self._expiry_timer: asyncio.TimerHandle | None = None
        self._gc_policy = GcPolicy()
        self._takeover_check: asyncio.Task[None] | None = None
        self._restoring: dict[str, asyncio.Task[None]] = {}
        # Restored session -> end of the time in which clients may reconnect to it; loop time.
        self._resumed: dict[str, float] = {}

    async def start(self) -> None:
        """Load what all sessions share.

        Raises:
            ValueError: the scene file is not a scene.
            FaceError: there is no such face.
            TableError: the mapping, or a user's expression, cannot be used.
            JournalError: the journal cannot be opened.
        """
        self._loop.start()
        await self._factory.load()
        self._expiry_timer = asyncio.get_running_loop().call_later(EXPIRY_INTERVAL, self._expire_sessions)

    def stop_accepting(self) -> None:
        """Refuse documents from now on."""
        self._factory.ending = True
        for session in self._registry.sessions.values():
            session.is_ending = True

    async def drain(self) -> None:
        """Wait at most `settings.drain` seconds for what plays."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(self.settings.drain):
                while self.busy:
                    await asyncio.sleep(DRAIN_STEP)

    @property
    def is_ending(self) -> bool:
        """Whether documents are refused."""
        return self._factory.ending

    @property
    def busy(self) -> bool:
        """Whether a block plays, waits or is being prepared."""
        sessions = self._registry.sessions.values()
        return any(self._loop.is_busy(session) or session.busy for session in sessions)

    async def close(self) -> None:
        """End every session and every engine."""
        for task in (self._expiry_timer, self._takeover_check):
            if task is not None:
                task.cancel()
        await self._loop.close(self._registry.sessions.values())
        self._factory.close()

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
        self._loop.call(session, partial(self._receive, session, number, message), number)
        self._loop.report_slow_step(began, f"a message of {len(message)} characters", session, [number])
        return True

    def is_congested(self, number: int) -> bool:
        """Return whether so many messages of a connection's session wait that no more should be read."""
        session = self._registry.session_of.get(number)
        return session is not None and self._loop.count_waiting(session) >= MOST_WAITING

    async def wait_for_room(self, number: int) -> None:
        """Wait while a connection's session is congested."""
        while self.is_congested(number):
            await asyncio.sleep(CONGESTION)

    def _receive(self, session: Session, number: int, message: str | bytes) -> None:
        if (present := self._registry.session_of.get(number)) is not session and present is not None:
            self.receive(number, message)  # it has moved while the message waited
            return
        # A client that only asks and never reads must be noticed here: nothing else may ever be due.
        self._loop.update_backlog(session, number)
        session.receive(number, message, self._loop.time())

    def leave(self, number: int) -> None:
        """Remove a closed connection."""
        left = self._registry.session_of.get(number)
        if left is not None and (connection := left.connections.get(number)) is not None:
            self.metrics.counts["frames_dropped"] += connection.dropped
        self._registry.leave(number, self._loop.time())
        self._clients.pop(number, None)
        self._gc_policy.ended_connections += 1

    # sessions -----------------------------------------------------------------------------------

    def check(self, name: str | None, visitor: Visitor = ANYBODY) -> None:
        """Check whether a client may join. Raises as `SessionRegistry.check`."""
        self._registry.check(name, visitor)

    async def restore(self, name: str | None, seen: int | None = None) -> None:
        """Take over a session of another process, before a client joins it.

        Raises:
            JournalError: the journal cannot be read, or the session not be restored.
        """
        if self._factory.journal is None or name is None:
            return
        if not self._is_live(name):
            if name not in self._restoring:
                self._restoring[name] = asyncio.create_task(self._restore(name, seen or 0))
            await asyncio.shield(self._restoring[name])
        session = self._registry.sessions.get(name)
        if session is not None and name in self._resumed and session.feedback_log.newest < (seen or 0):
            self._loop.call(session, partial(self._catch_up, session, seen or 0))

    def _is_live(self, name: str) -> bool:
        """Whether the session plays here. One that another process has taken over may still be registered."""
        session = self._registry.sessions.get(name)
        return session is not None and not session.closed

    async def _restore(self, name: str, seen: int) -> None:
        try:
            restored = await self._factory.restore(name, seen, self._loop.engines.speak)
            if restored is not None:
                session, unanswered = restored
                self._registry.sessions[name] = session
                self._resumed[name] = self._loop.time() + self.settings.keep
                self._loop.run(session, unanswered)
                self._loop.apply_effects(session)
        finally:
            del self._restoring[name]

    def _catch_up(self, session: Session, seen: int) -> None:
        from realizer.server.journal.replay import catch_up

        now = self._loop.time()
        session.clock.opened -= catch_up(session, now, seen) - now

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
        self._loop.run(session, [Close(number, code, reason) for number in numbers])
        self._registry.end(session)
        self._loop.apply_effects(session)

    def _fail(self, session: Session, sender: int | None) -> None:
        """Recover a session in which an exception was raised: what it accepted plays on, its clients stay.

        The fault costs the message that was handled: its sender gets an error, with an id that is in the log.
        """
        from realizer.server.journal.recovery import recover

        fault = f"internal error {secrets.token_hex(4)}"
        log.exception("session %s: %s", session.id, fault)
        self.metrics.counts["failures"] += 1
        words = f"{fault}: this was not handled; the log of the service says why"
        if sender is not None and (client := self._clients.get(sender)) is not None:
            client.send(ErrorMessage(code="internal", message=words).text())
        if session.closed:
            return
        now = self._loop.time()
        session.failures = [at for at in session.failures if at > now - FAILING] + [now]
        self._loop.run(session, [effect for effect in session.take_effects() if isinstance(effect, Send)])
        saved = session.journal.saved()
        try:
            if saved is None or len(session.failures) > MOST_FAILURES:
                raise RealizerError("it has failed again and again" if saved else "it accepted too much")
            unanswered, left_out = recover(
                session, saved, self._loop.speak, now, words, failed_before=len(session.failures) > 1
            )
        except Exception as error:
            log.error("session %s ends: %s", session.id, error)
            self._end(session, 1011, "internal error")
            return
        session.journal.leave_out(left_out)
        self._loop.run(session, unanswered)

    # every few seconds --------------------------------------------------------------------------

    def _compact_journal(self, session: Session) -> None:
        if self._loop.is_closed:
            return
        began = self._loop.time()
        self._loop.call(session, lambda: session.compact_journal(self._loop.time()))
        self._loop.report_slow_step(began, "a checkpoint of the journal", session)

    async def _check_takeovers(self) -> None:
        for session in await self._factory.taken_over(self._registry.sessions.values()):
            self._loop.cancel(session)
            waiting = self._registry.joined(session).difference(session.connections)
            session.hand_over(error := TakenOver(session.id))
            self._loop.apply_effects(session)
            self._loop.run(session, [Close(number, 1012, str(error)) for number in waiting])

    def _expire_sessions(self) -> None:
        sessions = self._registry.sessions.values()
        blocks = [p.block for session in sessions for p in session.player.blocks.all()]
        blocks += [p.block for session in sessions for p in session.submission.pending.blocks]
        self._gc_policy.collect_if_needed(len(self._clients), sum(len(block.behaviours) for block in blocks))
        self.metrics.count()
        now = self._loop.time()
        self._overload.end_if_over(now)
        self._registry.remove_expired(now)
        self._resumed = {name: end for name, end in self._resumed.items() if end > now}
        # Spread the checkpoints over the time until the next call.
        grown = [session for session in self._registry.sessions.values() if session.journal.needs_checkpoint]
        for k, session in enumerate(grown):
            asyncio.get_running_loop().call_later(
                EXPIRY_INTERVAL * k / len(grown), self._compact_journal, session
            )
        if self._takeover_check is None or self._takeover_check.done():
            self._takeover_check = asyncio.create_task(self._check_takeovers())
        self._expiry_timer = asyncio.get_running_loop().call_later(EXPIRY_INTERVAL, self._expire_sessions)
