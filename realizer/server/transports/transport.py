"""The protocols between transports and the sessions of the service."""

from __future__ import annotations

from typing import Protocol

from realizer.server.http.metrics import Metrics
from realizer.server.runtime.session_registry import ANYBODY, Visitor


class Outbound(Protocol):
    """The way out to one connection. Called inside the event loop; never blocks."""

    @property
    def unsent_bytes(self) -> int:
        """Bytes that were not yet taken by the network."""
        ...

    def send(self, data: str | bytes) -> None:
        """One message of the session: feedback, a reply, a frame. A client leaves out what it cannot take."""
        ...

    def disconnect(self, code: int, reason: str) -> None:
        """The session lets go of it; the codes are those of a WebSocket close."""
        ...


class Sessions(Protocol):
    """The sessions of the service, as transports use them."""

    @property
    def metrics(self) -> Metrics:
        """The counters of the service."""
        ...

    def check(self, name: str | None, visitor: Visitor = ANYBODY) -> None:
        """Check whether a client could join.

        Raises:
            HubError: a bad name, one that is not for it, or too many sessions.
        """
        ...

    async def restore(self, name: str | None, seen: int | None = None) -> None:
        """Take over a session that another process has had, before a client joins it.

        Raises:
            JournalError: the journal cannot be read.
        """
        ...

    def join(
        self, client: Outbound, name: str | None = None, seen: int | None = None, visitor: Visitor = ANYBODY
    ) -> int:
        """Add a client to the session of that name, or to one of its own; returns its number.

        Args:
            seen: seq of the feedback that it had last.

        Raises:
            HubError: as `check`.
        """
        ...

    def receive(self, number: int, message: str | bytes) -> bool:
        """Pass on a message of a client; False if it is in no session any more."""
        ...

    def leave(self, number: int) -> None:
        """Remove a client that is gone."""
        ...


class Transport(Protocol):
    """One way in. `start`, then `ready` waits until clients can come; `stop_accepting` and `close` end it."""

    @property
    def startup_lines(self) -> tuple[str, ...]:
        """What is printed when it is ready: where it is."""
        ...

    async def start(self) -> None:
        """Open.

        Raises:
            OSError: the address cannot be had.
            RealizerError: something must be installed.
        """
        ...

    async def ready(self) -> None:
        """Return once clients can come in; for a door that depends on others this may take for ever."""
        ...

    def stop_accepting(self) -> None:
        """Take no new clients; those that are in stay."""
        ...

    async def close(self) -> None:
        """Let everybody go. Called once after a `start` that succeeded."""
        ...
