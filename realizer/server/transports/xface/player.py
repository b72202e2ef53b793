"""The Xface player transport: a client of a player, which shows the frames of a session."""

import asyncio
import json
import logging
from collections.abc import Callable

from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.reconnecting import ReconnectingTransport
from realizer.server.transports.xface.player_link import PlayerLink, State

log = logging.getLogger(__name__)

CONNECT_TIMEOUT = 5.0  # s, including the greeting
READ_SIZE = 4096  # bytes
MAX_UNREAD = 2**18  # bytes that the player has not read; hundreds of frames
# The frames of the first character, at the rate of the service, and no feedback.
SUBSCRIPTIONS = (
    '{"type":"unsubscribe","stream":"feedback"}',
    '{"type":"subscribe","stream":"fap","encoding":"json"}',
)


class XfacePlayerTransport(ReconnectingTransport):
    """A client of the player at `settings.xface_player`, which reconnects whenever the connection is lost.

    The player shows the first character of the session `settings.xface_player_session`.
    """

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.xface_player is not None
        super().__init__("xface player", settings.xface_player)
        self._session = settings.xface_player_session
        self._sessions = sessions
        self._link = PlayerLink(settings.xface_player_interval)
        self._writer: asyncio.StreamWriter | None = None
        self._timer: asyncio.TimerHandle | None = None

    @property
    def startup_lines(self) -> tuple[str, ...]:
        return (f"xface player: {self._peer} shows session {self._session}",)

    def stop_accepting(self) -> None:
        """Continue, because playing blocks are shown to their end."""

    # the session's side --------------------------------------------------------------------------

    @property
    def unsent_bytes(self) -> int:
        """Always 0, because only the last frame is stored."""
        return 0

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str) and data.startswith("{"):
            message = json.loads(data)
            if message["type"] == "fap":
                self._link.show(message["values"])
                self._pump()

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("xface player: session %s ends: %s", self._session, reason)
        if self._writer is not None:
            self._writer.transport.abort()  # then it connects again

    # the player's side ---------------------------------------------------------------------------

    async def _serve(self, connected: Callable[[], None]) -> str:
        try:
            reader = await self._connect()
            connected()
            await self._show(reader)
            return f"the player at {self._peer} is gone"
        except JoinError as error:
            return str(error)
        except OSError as error:  # also TimeoutError
            return f"no player at {self._peer} ({error.strerror or str(error) or 'nobody answers'})"
        finally:
            self._close()

    async def _connect(self) -> asyncio.StreamReader:
        """Connect to the player and wait for its greeting."""
        async with asyncio.timeout(CONNECT_TIMEOUT):
            reader, self._writer = await asyncio.open_connection(*self._address)
            if self._writer.get_extra_info("sockname") == self._writer.get_extra_info("peername"):
                raise OSError("nobody answers")  # a TCP self-connect
            self._link.on_connect()
            while self._link.state is State.GREETING:
                if not (data := await reader.read(READ_SIZE)):
                    raise OSError("it closes the connection")
                self._link.receive(data)
        return reader

    async def _show(self, reader: asyncio.StreamReader) -> None:
        """Show the frames of the session until the connection is lost."""
        number = self._sessions.join(self, self._session)
        self._up.set()
        try:
            for message in SUBSCRIPTIONS:
                self._sessions.receive(number, message)
            while data := await reader.read(READ_SIZE):
                self._link.receive(data)
                self._pump()
        finally:
            self._sessions.leave(number)

    def _pump(self) -> None:
        """Send what is due, and schedule the next call."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._writer is None:
            return
        now = self._loop.time()
        while (task := self._link.due(now)) is not None:
            self._writer.write(task)
        if self._writer.transport.get_write_buffer_size() > MAX_UNREAD:
            log.warning("xface player: %s reads nothing and is disconnected", self._peer)
            self._writer.transport.abort()
        if (at := self._link.next_deadline()) is not None:
            self._timer = self._loop.call_at(at, self._pump)

    def _close(self) -> None:
        if self._writer is not None:
            self._writer.transport.abort()
            self._writer = None
        self._link.on_disconnect()
        self._pump()
