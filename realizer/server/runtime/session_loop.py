"""The sessions' part of the event loop: calls them, carries out their effects, wakes them in time."""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TypeVar

from realizer.core import work
from realizer.core.errors import RealizerError
from realizer.core.work import FairPool
from realizer.server.http.metrics import Metrics
from realizer.server.runtime.edit_folder import save
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.turns import ReadingTurns, SlicedCalls, WakeUps
from realizer.server.session.connections import SLOW
from realizer.server.session.effects import Close, Draw, Effect, Look, MoveConnection, Send, Speak, Write
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import Overload
from realizer.server.transports.transport import Outbound
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)

E = TypeVar("E", Speak, Draw, Look, Write)
R = TypeVar("R")

FRAME_SLICES = 5  # of time; frames that take longer to compute are continued with the documents, in turn
SLOW_STEP = 0.05  # s; a step of the loop that takes so long is logged


class SessionLoop:
    """Calls sessions in an event loop, carries out what they return, and wakes them when something is due.

    Args:
        clients: the ways out, by number of connection.
        move: moves connections between sessions, and returns the effects that are left.
        on_failure: called in the handler of an exception that a session has raised, with the connection whose
            message it was handling, or None.
    """

    def __init__(
        self,
        engines: Engines,
        clients: Mapping[int, Outbound],
        metrics: Metrics,
        overload: Overload,
        move: Callable[[Session, list[Effect], float], list[Effect]],
        on_failure: Callable[[Session, int | None], None],
    ) -> None:
        self.engines = engines
        self.is_closed = False
        self._clients = clients
        self._metrics = metrics
        self._overload = overload
        self._move = move
        self._on_failure = on_failure

    def start(self) -> None:
        """Begin in the present event loop."""
        self._loop = asyncio.get_running_loop()
        self._wake_ups = WakeUps[Session](self._loop, self._wake)
        self._reading = ReadingTurns[Session](
            self._loop, self._read, lambda: self._overload.is_active and self._wake_ups.is_behind
        )
        self._calls = SlicedCalls[Session](self._reading.add, self._loop.call_soon_threadsafe)

    async def close(self, sessions: Iterable[Session]) -> None:
        """End these sessions and every engine."""
        self.is_closed = True
        self._reading.close()
        self._wake_ups.close()
        for session in sessions:
            session.close()
        self._calls.close()
        await self._loop.run_in_executor(None, self.engines.close)

    def time(self) -> float:
        """Return seconds on the clock of the loop."""
        return self._loop.time()

    # calls and effects --------------------------------------------------------------------------

    def call(self, session: Session, function: Callable[[], None], sender: int | None = None) -> bool:
        """Call a function that changes a session, and carry out the effects.

        If it takes long, or if other calls of the session have not ended, it ends later.

        Args:
            sender: the connection whose message the function handles.

        Returns:
            Whether it has ended.
        """

        def step() -> None:
            try:
                function()
            except Exception:
                self._on_failure(session, sender)
            self.apply_effects(session)

        self._calls.call(session, step)
        return not self._calls.is_busy(session)

    def is_busy(self, session: Session) -> bool:
        """Return whether a call of a session has not ended."""
        return self._calls.is_busy(session)

    def count_waiting(self, session: Session) -> int:
        """Return how many calls of a session wait."""
        return self._calls.count_waiting(session)

    def speak(self, order: Speak) -> Utterance | RealizerError:
        """Synthesize speech in a thread, while the present call of a session waits."""
        return self._calls.wait_for(self.engines.speak, order)

    def cancel(self, session: Session) -> None:
        """Drop the calls of a session that have not ended."""
        self._calls.cancel(session)

    def apply_effects(self, session: Session) -> None:
        """Carry out what a session wants done, and wake it when it is due again."""
        effects = session.take_effects()
        if any(isinstance(effect, MoveConnection) for effect in effects):
            effects = self._move(session, effects, self._loop.time())
        self.run(session, effects)
        if session.closed:
            self.engines.drop(session)
        self._schedule_wakeup(session)

    def run(self, session: Session, effects: Iterable[Effect]) -> None:
        """Carry out effects of a session."""
        for effect in work.counted(effects, 5):
            try:
                self._carry_out(session, effect)
            except Exception:  # one client, voice or picture: the others get theirs
                log.exception("session %s: %s failed", session.id, type(effect).__name__)
                self._metrics.counts["failures"] += 1

    def _carry_out(self, session: Session, effect: Effect) -> None:
        engines = self.engines
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
        if self.is_closed:
            return
        self._wake_ups.set(session, session.next_due())
        if session.has_documents:
            self._reading.add(session)

    def _wake(self, session: Session, when: float) -> None:
        """Send the frames and the feedback of a session that are due, and do what else is."""
        now = self._loop.time()
        self._metrics.late.observe(now - when)
        self._overload.note(now - when, now)
        if not self._calls.is_busy(session):  # else it is woken again when its call has ended
            self._calls.call(session, partial(self._send_due, session, now), FRAME_SLICES)
        self.report_slow_step(now, "frames and feedback", session)

    def _send_due(self, session: Session, now: float) -> None:
        try:
            due = session.ticker.send_ready(session.clock.read(now))
        except Exception:
            self._on_failure(session, None)
            self.apply_effects(session)
            return
        if due is None:
            self.call(session, partial(self._work, session, now, read_documents=False))
            return
        self.run(session, session.take_effects())
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
            self.call(session, partial(self._read_document, session, began))
        self.report_slow_step(began, "a document", session)

    def _read_document(self, session: Session, now: float) -> None:
        plans = session.player.version
        self._work(session, now, read_documents=True)
        if session.player.version != plans:
            self._metrics.planning.observe(self._loop.time() - now)

    def _work(self, session: Session, now: float, *, read_documents: bool) -> None:
        self.update_backlog(session, *session.connections)
        session.tick(now, read_documents=read_documents)

    def update_backlog(self, session: Session, *numbers: int) -> None:
        """Tell a session how many bytes wait for these connections."""
        for number in numbers:
            if (client := self._clients.get(number)) is not None:
                session.update_backlog(number, client.unsent_bytes)

    def report_slow_step(
        self, began: float, action: str, session: Session, connections: Iterable[int] | None = None
    ) -> None:
        """Report a step of the loop if it took so long that it delayed the frames of all clients."""
        seconds = self._loop.time() - began
        if seconds >= SLOW_STEP:
            clients = list(session.connections if connections is None else connections)
            self._metrics.report_slow_step(seconds, action, session.id, clients)

    def _deliver(self, session: Session, answer: Callable[[], None]) -> None:
        if not self.is_closed:
            began = self._loop.time()
            self.call(session, answer)
            self.report_slow_step(began, "the result of a voice or a renderer", session)
