"""The registry of sessions by name, with their connections and expiry."""

import re
import secrets
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, limit_hint
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.documents.limits import memory_error
from realizer.server.session.effects import Close, Effect, MoveConnection, Send
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import Overload

SESSION_ID = re.compile(r"[A-Za-z0-9._~-]{1,64}")
# Sessions of other transports than the WebSocket, which are open in the first worker only.
FIRST_WORKER = re.compile("(asap|xface|stomp)-")


def worker_of(session: str, workers: int, settings: Settings) -> int:
    """Return the number of the worker that has the session of that name."""
    if (
        workers == 1
        or FIRST_WORKER.match(session)
        or session in (settings.xface_player_session, settings.avatar_session)
    ):
        return 0
    return zlib.crc32(session.encode()) % workers


class JoinError(RealizerError):
    """A connection or a request that is refused.

    Args:
        status: HTTP status of the answer.
        retry: whether another try later may succeed, of one that is refused for want of room.
    """

    def __init__(self, status: int, text: str, *, retry: bool = True) -> None:
        super().__init__(text)
        self.status = status
        self.retry = retry and status in (429, 503)


@dataclass(frozen=True, slots=True)
class Visitor:
    """The origin and the rights of a connection."""

    address: str = ""  # IP address; "" if unknown, as for other transports than the WebSocket
    sessions: frozenset[str] | None = None  # names of the sessions it may join; None: any
    may_edit: bool = False  # whether it may save files of the service


ANYBODY = Visitor()


def call_now(session: Session, function: Callable[[], None]) -> bool:
    """Call a function at once."""
    function()
    return True


class SessionRegistry:
    """All sessions of the service, by name and by connection.

    Args:
        is_local: (name) -> whether the session of that name belongs to this process.
        call: (session, function) -> calls a function that changes a session, now or when its other calls have
            ended; and returns whether it was now.
    """

    def __init__(
        self,
        make: Callable[[str, float, bool], Session],
        settings: Settings,
        is_local: Callable[[str], bool] = lambda name: True,
        call: Callable[[Session, Callable[[], None]], bool] = call_now,
        cancel: Callable[[Session], None] = lambda session: None,
        overload: Overload | None = None,
    ) -> None:
        self._overload = overload or Overload()
        self._call = call
        self._cancel = cancel
        self._is_local = is_local
        self._make = make
        self._settings = settings
        self.sessions: dict[str, Session] = {}
        self.session_of: dict[int, Session] = {}
        self._joined: dict[Session, set[int]] = {}  # `session_of` by session
        self._visitors: dict[int, Visitor] = {}
        self._opened_by: dict[str, str] = {}  # session -> the address that opened it

    def check(self, name: str | None, visitor: Visitor = ANYBODY, ends: Session | None = None) -> None:
        """Check whether a connection may join or create a session.

        Args:
            ends: a session that will end before.

        Raises:
            JoinError: 400: the name is invalid; 403: the visitor may not join that session; 429: it has
                opened too many sessions; 503: too many sessions are open, memory is used up, or the process
                is overloaded.
        """
        if name is not None and not SESSION_ID.fullmatch(name):
            words = f"session: wanted 1..64 letters, digits or . _ ~ -, got {name[:80]!r}"
            raise JoinError(400, words)
        if visitor.sessions is not None and name not in visitor.sessions:
            wanted = ", ".join(sorted(visitor.sessions)[:10]) or "none at all"
            got = "none" if name is None else repr(name)
            raise JoinError(403, f"session: wanted one that the token is for ({wanted}), got {got}")
        if name in self._opened_by and name in self.sessions:
            return
        most, opened = self._settings.max_address_sessions, self._opened_count(visitor.address)
        if ends is not None and self._opened_by.get(ends.id) == visitor.address:
            opened -= 1
        if visitor.address and opened >= most and not self._abandoned(visitor.address):
            words = f"{most} sessions that {visitor.address} has opened live: wanted fewer"
            raise JoinError(429, f"{words} {limit_hint('max_address_sessions')}")
        if name in self.sessions:
            return
        most = self._settings.max_sessions
        if len(self.sessions) - (ends is not None) >= most and not self._abandoned():
            raise JoinError(503, f"{most} sessions are open: wanted fewer {limit_hint('max_sessions')}")
        if ends is None and (full := memory_error(self._settings)) is not None:
            raise JoinError(503, full)
        if ends is None and self._overload.is_active:
            raise JoinError(503, "the service is overloaded, and opens no new sessions: try again later")

    def open(
        self,
        connection: int,
        name: str | None,
        now: float,
        seen: int | None = None,
        visitor: Visitor = ANYBODY,
    ) -> Session:
        """Add a connection to the named session, which is created if it is missing, or to a new one.

        Raises:
            JoinError: as `check`.
        """
        if name is not None and (old := self.sessions.get(name)) is not None and old.closed:
            self.remove(old)  # another process has taken it over; its connections are closing
        self.check(name, visitor)
        id = secrets.token_urlsafe(9) if name is None else name
        # A restored session counts against the address of the first client that joins it.
        if id not in self._opened_by or id not in self.sessions:
            if visitor.address and self._opened_count(visitor.address) >= self._settings.max_address_sessions:
                self.end(self._abandoned(visitor.address)[0])
            if id not in self.sessions:
                if len(self.sessions) >= self._settings.max_sessions:
                    self.end(self._abandoned()[0])
                self.sessions[id] = self._make(id, now, name is not None)
            self._opened_by[id] = visitor.address
        session = self.session_of[connection] = self.sessions[id]
        self._joined.setdefault(session, set()).add(connection)
        self._visitors[connection] = visitor
        self._call(session, partial(session.connect, connection, now, seen, may_edit=visitor.may_edit))
        return session

    def leave(self, connection: int, now: float) -> None:
        """Remove a closed connection, and its session if that ends with it."""
        self._visitors.pop(connection, None)
        session = self.session_of.pop(connection, None)
        if session is None:
            return
        self._joined[session].remove(connection)
        if not self._joined[session]:
            del self._joined[session]
            if not session.named:
                self._cancel(session)  # nobody wants the result
        self._call(session, partial(self._disconnect, session, connection, now))

    def joined(self, session: Session) -> frozenset[int]:
        """Return the connections of a session, also those that it will connect when its calls have ended."""
        return frozenset(self._joined.get(session, ()))

    def _disconnect(self, session: Session, connection: int, now: float) -> None:
        joined = self.joined(session)
        # Others have left too whose own call was cancelled.
        for left in {connection, *session.connections} - joined:
            session.disconnect(left, now, is_awaited=bool(joined))
        if session.closed and self.sessions.get(session.id) is session:
            session.journal.end()
            self.remove(session)

    def remove(self, session: Session) -> None:
        """Remove a session that has ended."""
        if self.sessions.get(session.id) is session:
            del self.sessions[session.id]
            self._opened_by.pop(session.id, None)

    def move_connections(self, session: Session, taken: Iterable[Effect], now: float) -> list[Effect]:
        """Move the connections that change to another session, and return the effects that are left."""
        effects: list[Effect] = []
        moved: set[int] = set()
        for effect in taken:
            if isinstance(effect, Send) and effect.connection in moved:
                continue  # the client would take it for a message of the session it is in now
            if not isinstance(effect, MoveConnection):
                effects.append(effect)
                continue
            if self.session_of.get(effect.connection) is not session:
                continue  # it has left while its message waited
            visitor = self._visitors.get(effect.connection, ANYBODY)
            words = self._refusal(effect, session, visitor)
            if words is not None:
                refused = ErrorMessage(code="invalid", message=words, where="hello.session")
                effects.append(Send(effect.connection, refused.text()))
                continue
            self.leave(effect.connection, now)
            moved.add(effect.connection)
            try:
                joined = self.open(effect.connection, effect.session, now, visitor=visitor)
            except JoinError as error:  # the journal cannot store it, and the old session may have ended
                effects.append(Close(effect.connection, 1013, str(error)))
                continue
            if self._call(joined, partial(self._welcome, joined, effect, now)):
                effects += joined.take_effects()
        return effects

    @staticmethod
    def _welcome(joined: Session, move: MoveConnection, now: float) -> None:
        if not joined.closed:  # another process may have taken it over meanwhile
            joined.queries.send_welcome(move.connection, joined.clock.read(now), move.seen)

    def _refusal(self, move: MoveConnection, left: Session, visitor: Visitor) -> str | None:
        if not self._is_local(move.session):
            target = f"/ws?session={move.session}" + ("" if move.seen is None else f"&seen={move.seen}")
            return f"hello reaches the sessions of this process only: connect to {target} instead"
        try:
            self.check(move.session, visitor, None if left.named or len(left.connections) > 1 else left)
        except JoinError as error:
            return str(error)
        return None

    def remove_expired(self, now: float) -> None:
        """End the sessions that have had no connection for too long."""
        for session in [s for s in self.sessions.values() if s.is_expired(now) and not self.joined(s)]:
            self.end(session)

    def _abandoned(self, address: str | None = None) -> list[Session]:
        """Return the sessions without connections, the longest abandoned first: they make room for others.

        Args:
            address: only the sessions that it has opened.
        """
        abandoned = [
            (s.empty_since, s.id, s)
            for s in self.sessions.values()
            if s.empty_since is not None and not self.joined(s)
            if address in (None, self._opened_by.get(s.id))
        ]
        return [session for *_, session in sorted(abandoned)]

    def _opened_count(self, address: str) -> int:
        return list(self._opened_by.values()).count(address)

    def end(self, session: Session) -> None:
        """End a session; its connections stay until they leave."""
        self._cancel(session)
        session.close()
        session.journal.end()
        self.remove(session)
