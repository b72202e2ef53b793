"""The registry of sessions by name, with their connections and expiry."""

from __future__ import annotations

import re
import secrets
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, raises
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.documents.limits import used_up
from realizer.server.session.effects import Close, Effect, Move, Send
from realizer.server.session.session import Session

SESSION_ID = re.compile(r"[A-Za-z0-9._~-]{1,64}")


# Sessions that other doors than the WebSocket make; these doors are open in the first worker.
OF_DOORS = re.compile("(asap|xface|stomp)-")


def worker_of(session: str, workers: int, settings: Settings) -> int:
    """Return the number of the worker that has the session of that name."""
    if workers == 1 or OF_DOORS.match(session) or session == settings.xface_player_session:
        return 0
    return zlib.crc32(session.encode()) % workers


class HubError(RealizerError):
    """A connection that cannot be had; `status` is the HTTP status to answer with."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True, slots=True)
class Visitor:
    """Who comes in.

    Attributes:
        address: where from; "" where that is not known, as of doors of our own.
        sessions: those it may be in; None: any.
    """

    address: str = ""
    sessions: frozenset[str] | None = None


ANYBODY = Visitor()


class Hub:
    """All sessions of the service.

    Args:
        make: (id, now, named) -> Session.
        settings: how many there may be.
        ours: (name) -> whether the session of that name is in this process.
    """

    def __init__(
        self,
        make: Callable[[str, float, bool], Session],
        settings: Settings,
        ours: Callable[[str], bool] = lambda name: True,
    ) -> None:
        self._ours = ours
        self._make = make
        self._settings = settings
        self.sessions: dict[str, Session] = {}
        self._of: dict[int, Session] = {}
        self._who: dict[int, Visitor] = {}
        self._openers: dict[str, str] = {}  # session -> the address that opened it
        self._opened: Counter[str] = Counter()  # address -> how many of them live

    def check(self, name: str | None, visitor: Visitor = ANYBODY) -> None:
        """Whether a connection may join or make a session.

        Raises:
            HubError: 400 for a bad name, 403 for one that is not for this visitor, 429 where it has opened
                too many, 503 where there are too many or there is no memory.
        """
        self._check(name, visitor)

    def _check(self, name: str | None, visitor: Visitor, ends: Session | None = None) -> None:
        """As `check`, where another session ends first."""
        if name is not None and not SESSION_ID.fullmatch(name):
            words = f"session: wanted 1..64 letters, digits or . _ ~ -, got {name[:80]!r}"
            raise HubError(400, words)
        if visitor.sessions is not None and name not in visitor.sessions:
            wanted = ", ".join(sorted(visitor.sessions)[:10]) or "none at all"
            got = "none" if name is None else repr(name)
            raise HubError(403, f"session: wanted one that the token is for ({wanted}), got {got}")
        if name in self._openers and name in self.sessions:
            return
        most, opened = self._settings.max_address_sessions, self._opened[visitor.address]
        if ends is not None and self._openers.get(ends.id) == visitor.address:
            opened -= 1
        if visitor.address and opened >= most and not self._left(visitor.address):
            words = f"{most} sessions that {visitor.address} has opened live: wanted fewer"
            raise HubError(429, f"{words} {raises('max_address_sessions')}")
        if name in self.sessions:
            return
        most = self._settings.max_sessions
        if len(self.sessions) - (ends is not None) >= most and not self._left():
            raise HubError(503, f"{most} sessions are open: wanted fewer {raises('max_sessions')}")
        if ends is None and (full := used_up(self._settings)) is not None:
            raise HubError(503, full)

    def open(
        self,
        connection: int,
        name: str | None,
        now: float,
        seen: int | None = None,
        visitor: Visitor = ANYBODY,
    ) -> Session:
        """Let a connection join the named session, or make it; without a name, one of its own.

        Raises:
            HubError: as `check`.
        """
        if name is not None and (old := self.sessions.get(name)) is not None and old.closed:
            self.forget(old)  # another process has it; those who were in it are on their way
        self._check(name, visitor)
        id = secrets.token_urlsafe(9) if name is None else name
        # One that was brought back from a journal is opened by who comes to it first.
        if id not in self._openers or id not in self.sessions:
            if visitor.address and self._opened[visitor.address] >= self._settings.max_address_sessions:
                self._end(self._left(visitor.address)[0])
            if id not in self.sessions:
                if len(self.sessions) >= self._settings.max_sessions:
                    self._end(self._left()[0])
                self.sessions[id] = self._make(id, now, name is not None)
            self._openers[id] = visitor.address
            self._opened[visitor.address] += 1
        session = self._of[connection] = self.sessions[id]
        self._who[connection] = visitor
        session.connect(connection, now, seen)
        return session

    def session_of(self, connection: int) -> Session | None:
        """The session a connection is in."""
        return self._of.get(connection)

    def leave(self, connection: int, now: float) -> None:
        """A connection is gone."""
        self._who.pop(connection, None)
        session = self._of.pop(connection, None)
        if session is not None:
            session.disconnect(connection, now)
            if session.closed:
                session.notes.end()
                self.forget(session)

    def forget(self, session: Session) -> None:
        """A session has ended."""
        if self.sessions.get(session.id) is session:
            del self.sessions[session.id]
            address = self._openers.pop(session.id, None)
            if address is not None:
                self._opened[address] -= 1
                if not self._opened[address]:
                    del self._opened[address]

    def effects(self, session: Session, now: float) -> list[Effect]:
        """What is to be done for a session; connections that move to another one are moved here."""
        effects: list[Effect] = []
        moved: set[int] = set()
        for effect in session.outgoing():
            if isinstance(effect, Send) and effect.connection in moved:
                continue  # it has been welcomed elsewhere: what comes from here would be taken for theirs
            if isinstance(effect, Move):
                visitor = self._who.get(effect.connection, ANYBODY)
                words = self._refusal(effect, session, visitor)
                if words is not None:
                    error = ErrorMessage(code="invalid", message=words, where="hello.session")
                    effects.append(Send(effect.connection, error.text()))
                    continue
                self.leave(effect.connection, now)
                moved.add(effect.connection)
                try:
                    there = self.open(effect.connection, effect.session, now, visitor=visitor)
                except HubError as error:  # it cannot be kept; what it has left may be gone
                    effects.append(Close(effect.connection, 1013, str(error)))
                    continue
                there.welcome(effect.connection, now)
                if effect.seen is not None:
                    there.resume(effect.connection, effect.seen)
                effects += there.outgoing()
            else:
                effects.append(effect)
        return effects

    def _refusal(self, move: Move, left: Session, visitor: Visitor) -> str | None:
        """Why a connection cannot move; None where it can. It may leave room behind it."""
        if not self._ours(move.session):
            there = f"/ws?session={move.session}" + ("" if move.seen is None else f"&seen={move.seen}")
            return f"hello reaches the sessions of this process only: connect to {there} instead"
        try:
            self._check(move.session, visitor, None if left.named or len(left.connections) > 1 else left)
        except HubError as error:
            return str(error)
        return None

    def sweep(self, now: float) -> None:
        """Close the sessions nobody has been in for too long."""
        for session in [s for s in self.sessions.values() if s.expired(now)]:
            self._end(session)

    def _left(self, address: str | None = None) -> list[Session]:
        """Sessions that wait for somebody to come back, the longest left first: they make room for others.

        Args:
            address: of these, those that it has opened.
        """
        left = [
            (s.empty_since, s.id, s)
            for s in self.sessions.values()
            if s.empty_since is not None and address in (None, self._openers.get(s.id))
        ]
        return [session for *_, session in sorted(left)]

    def _end(self, session: Session) -> None:
        session.close()
        session.notes.end()
        self.forget(session)
