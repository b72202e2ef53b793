"""Restoring of sessions that other processes had, from the journal."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, MutableMapping
from functools import partial

from realizer.server.runtime.effect_runner import Engines
from realizer.server.runtime.session_factory import SessionFactory
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session


class SessionRestorer:
    """Restores the sessions that other processes had.

    Args:
        factory: makes sessions from the journal.
        engines: synthesize their speech again.
        sessions: name -> session of this process; restored ones are added.
        keep: seconds for which clients may reconnect to a restored session.
        call: calls a function that changes a session, now or when its other calls have ended.
        adopt: takes a restored session, and its speech requests that are not answered yet.
    """

    def __init__(
        self,
        factory: SessionFactory,
        engines: Engines,
        sessions: MutableMapping[str, Session],
        keep: float,
        call: Callable[[Session, Callable[[], None]], object],
        adopt: Callable[[Session, list[Speak]], None],
    ) -> None:
        self._factory = factory
        self._engines = engines
        self._sessions = sessions
        self._keep = keep
        self._call = call
        self._adopt = adopt
        self._restoring: dict[str, asyncio.Task[None]] = {}
        self._resumed: dict[str, float] = {}  # session -> until when clients may reconnect; loop time

    async def restore(self, name: str | None, seen: int | None = None) -> None:
        """Take over a session of another process, before a client joins it.

        Args:
            seen: sequence number of the last feedback the client received, to which the session is advanced.

        Raises:
            JournalError: the journal cannot be read, or the session not be restored.
        """
        if self._factory.journal is None or name is None:
            return
        if not self.is_live(name):
            if name not in self._restoring:
                self._restoring[name] = asyncio.create_task(self._restore(name, seen or 0))
            await asyncio.shield(self._restoring[name])
        session = self._sessions.get(name)
        if session is not None and name in self._resumed and session.feedback_log.newest < (seen or 0):
            self._call(session, partial(self._catch_up, session, seen or 0))

    def is_live(self, name: str) -> bool:
        """Whether the session plays here. One that another process has taken over may still be registered."""
        session = self._sessions.get(name)
        return session is not None and not session.closed

    def expire(self, now: float) -> None:
        """Forget the restored sessions to which clients have had time to reconnect."""
        self._resumed = {name: end for name, end in self._resumed.items() if end > now}

    async def _restore(self, name: str, seen: int) -> None:
        try:
            restored = await self._factory.restore(name, seen, self._engines.speak)
            if restored is None:
                return
            session, unanswered = restored
            self._sessions[name] = session
            self._resumed[name] = asyncio.get_running_loop().time() + self._keep
            self._adopt(session, unanswered)
        finally:
            del self._restoring[name]

    def _catch_up(self, session: Session, seen: int) -> None:
        from realizer.server.journal.replay import catch_up

        now = asyncio.get_running_loop().time()
        session.clock.opened -= catch_up(session, now, seen) - now
