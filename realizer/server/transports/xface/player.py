"""The connection to an Xface player, which shows the frames of a session."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging

from realizer.core.settings import Settings
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.transport import Sessions
from realizer.server.transports.xface.player_link import PlayerLink, State

log = logging.getLogger(__name__)

FIRST_RETRY = 0.2  # s
LAST_RETRY = 10.0  # s
ATTEMPT = 5.0  # s; to connect, and to be greeted
READ = 4096  # bytes
STUCK = 2**18  # bytes that the player has not read: hundreds of frames
# The first character's frames, at the service's own rate; nothing of what happens.
WANTS = (
    '{"type":"unsubscribe","stream":"feedback"}',
    '{"type":"subscribe","stream":"fap","encoding":"json"}',
)


class XfacePlayerTransport:
    """A client of the player at `settings.xface_player` that comes back whenever the player does.

    What it shows is the first face of the session `settings.xface_player_session`, which is made for it.
    """

    def __init__(self, sessions: Sessions, settings: Settings) -> None:
        assert settings.xface_player is not None
        host, _, port = settings.xface_player.rpartition(":")
        self._address = (host.strip("[]"), int(port))
        self._settings = settings
        self._sessions = sessions
        self._link = PlayerLink(settings.xface_player_interval)
        self._writer: asyncio.StreamWriter | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._up = asyncio.Event()
        self._keeper: asyncio.Task[None] | None = None

    @property
    def startup_lines(self) -> tuple[str, ...]:
        settings = self._settings
        return (f"xface player: {settings.xface_player} shows session {settings.xface_player_session}",)

    async def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._keeper = asyncio.create_task(self._keep_connected())

    async def ready(self) -> None:
        await self._up.wait()

    def stop_accepting(self) -> None:
        """What plays is shown to its end."""

    async def close(self) -> None:
        if self._keeper is not None:
            self._keeper.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._keeper

    # the session's side --------------------------------------------------------------------------

    @property
    def unsent_bytes(self) -> int:
        """Nothing: of the frames that come, only the newest is kept."""
        return 0

    def send(self, data: str | bytes) -> None:
        """A frame, or something that a player cannot show."""
        if isinstance(data, str) and data.startswith("{"):
            message = json.loads(data)
            if message["type"] == "fap":
                self._link.show(message["values"])
                self._pump()

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("xface player: session %s ends: %s", self._settings.xface_player_session, reason)
        if self._writer is not None:
            self._writer.transport.abort()  # and soon there is another one

    # the player's side ---------------------------------------------------------------------------

    async def _keep_connected(self) -> None:
        """Be connected, until cancelled."""
        name = self._settings.xface_player
        pause, told = FIRST_RETRY, False
        while True:
            try:
                reader = await self._connect()
                log.log(logging.WARNING if told else logging.INFO, "xface player: %s shows us", name)
                pause, told = FIRST_RETRY, False
                await self._show(reader)
                words = f"the player at {name} is gone"
            except JoinError as error:
                words = str(error)
            except OSError as error:  # a timeout is one too
                words = f"no player at {name} ({error.strerror or str(error) or 'nobody answers'})"
            finally:
                self._part()
            if not told:
                log.warning("xface player: %s; looking for it", words)
                told = True
            await asyncio.sleep(pause)
            pause = min(2 * pause, LAST_RETRY)

    async def _connect(self) -> asyncio.StreamReader:
        """A connection to a player that has said its greeting."""
        async with asyncio.timeout(ATTEMPT):
            reader, self._writer = await asyncio.open_connection(*self._address)
            if self._writer.get_extra_info("sockname") == self._writer.get_extra_info("peername"):
                raise OSError("nobody answers")  # TCP has met itself on the way
            self._link.on_connect()
            while self._link.state is State.GREETING:
                if not (data := await reader.read(READ)):
                    raise OSError("it closes the connection")
                self._link.receive(data)
        return reader

    async def _show(self, reader: asyncio.StreamReader) -> None:
        """Frames of the session, until the player is gone."""
        number = self._sessions.join(self, self._settings.xface_player_session)
        self._up.set()
        try:
            for wants in WANTS:
                self._sessions.receive(number, wants)
            while data := await reader.read(READ):
                self._link.receive(data)
                self._pump()
        finally:
            self._sessions.leave(number)

    def _pump(self) -> None:
        """Send what is due, and come back when something will be."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._writer is None:
            return
        now = self._loop.time()
        while (task := self._link.due(now)) is not None:
            self._writer.write(task)
        if self._writer.transport.get_write_buffer_size() > STUCK:
            log.warning("xface player: %s reads nothing and is let go of", self._settings.xface_player)
            self._writer.transport.abort()
        if (at := self._link.next_deadline()) is not None:
            self._timer = self._loop.call_at(at, self._pump)

    def _part(self) -> None:
        if self._writer is not None:
            self._writer.transport.abort()
            self._writer = None
        self._link.on_disconnect()
        self._pump()
