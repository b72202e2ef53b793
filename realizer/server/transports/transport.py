"""The protocol of transports."""

from __future__ import annotations

from typing import Protocol


class Client(Protocol):
    """The way out to one connection. Called inside the event loop; never blocks."""

    @property
    def waiting(self) -> int:
        """Bytes that were not yet taken by the network."""
        ...

    def send(self, data: str | bytes) -> None:
        """One message of the session: feedback, a reply, a frame. A client leaves out what it cannot take."""
        ...

    def end(self, code: int, reason: str) -> None:
        """The session lets go of it; the codes are those of a WebSocket close."""
        ...


class Door(Protocol):
    """One way in. `start`, then `ready` waits until clients can come; `shut` and `close` end it."""

    @property
    def lines(self) -> tuple[str, ...]:
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

    def shut(self) -> None:
        """Take no new clients; those that are in stay."""
        ...

    async def close(self) -> None:
        """Let everybody go. Called once after a `start` that succeeded."""
        ...
