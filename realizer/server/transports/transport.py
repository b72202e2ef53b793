"""The protocols of transports and of their clients."""

from typing import Protocol


class Outbound(Protocol):
    """The way out to one client. Called in the event loop; never blocks."""

    @property
    def unsent_bytes(self) -> int:
        """Bytes that wait for the network."""
        ...

    def send(self, data: str | bytes) -> None:
        """Send a message of the session: feedback, a reply or a frame; ignore those the client cannot use."""
        ...

    def disconnect(self, code: int, reason: str) -> None:
        """Close the connection; the codes are those of WebSocket."""
        ...


class Transport(Protocol):
    """A transport, by which clients reach sessions: `start`, wait for `ready`, `stop_accepting`, `close`."""

    @property
    def startup_lines(self) -> tuple[str, ...]:
        """The lines to print when the transport is ready: its addresses."""
        ...

    async def start(self) -> None:
        """Open the transport.

        Raises:
            OSError: the address is not available.
            RealizerError: a package is not installed.
        """
        ...

    async def ready(self) -> None:
        """Return once clients can connect; if that depends on other programs, this may take for ever."""
        ...

    def stop_accepting(self) -> None:
        """Accept no new clients. Connected ones stay."""
        ...

    async def close(self) -> None:
        """Disconnect all clients. Called once, after a `start` that succeeded."""
        ...
