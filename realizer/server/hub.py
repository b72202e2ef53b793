"""Sessions by name: connections join, make, leave and outlive them. No sockets, no clock."""

from __future__ import annotations

import re
import secrets
from collections.abc import Callable

from realizer.errors import RealizerError
from realizer.server.effects import Close, Effect, Move, Send
from realizer.server.messages import ErrorMessage
from realizer.server.session import Session
from realizer.settings import raises

__all__ = ["Hub", "HubError"]

SESSION_ID = re.compile(r"[A-Za-z0-9._~-]{1,64}")


class HubError(RealizerError):
    """A connection that cannot be had; `status` is the HTTP status to answer with."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


class Hub:
    """All sessions of the service.

    Args:
        make: (id, now, named) -> Session.
        most: how many sessions there may be.
        ours: (name) -> whether the session of that name is in this process.
    """

    def __init__(
        self,
        make: Callable[[str, float, bool], Session],
        most: int,
        ours: Callable[[str], bool] = lambda name: True,
    ) -> None:
        self._ours = ours
        self._make = make
        self._most = most
        self.sessions: dict[str, Session] = {}
        self._of: dict[int, Session] = {}

    def check(self, name: str | None) -> None:
        """Whether a connection may join or make a session.

        Raises:
            HubError: 400 for a bad name, 503 where there are too many.
        """
        if name is not None and not SESSION_ID.fullmatch(name):
            words = f"session: wanted 1..64 letters, digits or . _ ~ -, got {name[:80]!r}"
            raise HubError(400, words)
        if (name is None or name not in self.sessions) and self._full and not self._left():
            raise HubError(503, f"{self._most} sessions are open: wanted fewer {raises('max_sessions')}")

    def open(self, connection: int, name: str | None, now: float, seen: int | None = None) -> Session:
        """Let a connection join the named session, or make it; without a name, one of its own.

        Raises:
            HubError: as `check`.
        """
        self.check(name)
        id = secrets.token_urlsafe(9) if name is None else name
        session = self.sessions.get(id)
        if session is None or session.closed:
            if self._full:
                self._end(self._left()[0])
            session = self.sessions[id] = self._make(id, now, name is not None)
        session.connect(connection, now, seen)
        self._of[connection] = session
        return session

    def session_of(self, connection: int) -> Session | None:
        """The session a connection is in."""
        return self._of.get(connection)

    def leave(self, connection: int, now: float) -> None:
        """A connection is gone."""
        session = self._of.pop(connection, None)
        if session is not None:
            session.disconnect(connection, now)
            if session.closed:
                session.notes.end()
                if self.sessions.get(session.id) is session:
                    del self.sessions[session.id]

    def effects(self, session: Session, now: float) -> list[Effect]:
        """What is to be done for a session; connections that move to another one are moved here."""
        effects: list[Effect] = []
        moved: set[int] = set()
        for effect in session.outgoing():
            if isinstance(effect, Send) and effect.connection in moved:
                continue  # it has been welcomed elsewhere: what comes from here would be taken for theirs
            if isinstance(effect, Move):
                words = None
                if not self._ours(effect.session):
                    words = f"wanted another worker's session in the address: /ws?session={effect.session}"
                elif not self._takes(effect, session):
                    words = f"{self._most} sessions are open: wanted fewer {raises('max_sessions')}"
                if words is not None:
                    error = ErrorMessage(code="invalid", message=words, where="hello.session")
                    effects.append(Send(effect.connection, error.text()))
                    continue
                self.leave(effect.connection, now)
                moved.add(effect.connection)
                try:
                    there = self.open(effect.connection, effect.session, now)
                except HubError as error:  # it cannot be kept; what it has left may be gone
                    effects.append(Close(effect.connection, 1013, str(error)[:120]))
                    continue
                there.welcome(effect.connection, now)
                if effect.seen is not None:
                    there.resume(effect.connection, effect.seen)
                effects += there.outgoing()
            else:
                effects.append(effect)
        return effects

    def _takes(self, move: Move, left: Session) -> bool:
        """Whether there is room in the session it goes to, or that it leaves."""
        ends = not left.named and len(left.connections) == 1
        return move.session in self.sessions or ends or not self._full or bool(self._left())

    def sweep(self, now: float) -> None:
        """Close the sessions nobody has been in for too long."""
        for session in [s for s in self.sessions.values() if s.expired(now)]:
            self._end(session)

    @property
    def _full(self) -> bool:
        return len(self.sessions) >= self._most

    def _left(self) -> list[Session]:
        """Sessions that wait for somebody to come back, the longest left first: they make room for others."""
        left = [(s.empty_since, s.id, s) for s in self.sessions.values() if s.empty_since is not None]
        return [session for *_, session in sorted(left)]

    def _end(self, session: Session) -> None:
        session.close()
        session.notes.end()
        del self.sessions[session.id]
