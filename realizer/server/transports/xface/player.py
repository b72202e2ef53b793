"""The Xface player transport: a client of a player, which shows the frames of a session (Paul 2010)."""

import asyncio
import json
import logging
from collections.abc import Callable, Sequence
from enum import Enum

import numpy as np

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.frames import FAPFrames
from realizer.core.settings import Settings
from realizer.outputs.fap_text import encode
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.reconnecting import ReconnectingTransport
from realizer.server.transports.xface.wire import Status, Task, pack_task, read_notes

PATIENCE = 2.0  # s; after so long without a note the task is taken for lost
# The tasks of client k have numbers from k times this one.
NUMBERS = 1_000_000
_ENDED = (Status.FINISHED, Status.ERROR)


class State(Enum):
    """The state of the link: a task is sent only in READY or UPLOADED, one at a time."""

    CLOSED = "not connected"
    GREETING = "connected, waiting for the greeting"
    READY = "no task is pending"
    UPLOADING = "a frame is being uploaded"
    UPLOADED = "a frame is uploaded and not shown yet"
    STOPPING = "the stop that shows it is pending"


_WAITING = (State.UPLOADING, State.STOPPING)


class PlayerLink:
    """The protocol of one player, without sockets (Paul 2010, 4.2.2).

    A player shows a frame only at a STOP_PLAYBACK after the upload of a FAP file of one frame. Each task must
    wait for the note that the one before is finished, because the player takes two tasks in one read for one.
    Of the frames that arrive meanwhile only the last is shown.

    Args:
        interval: least seconds between uploads. Paul found that the player shows nothing at less than 0.25.
    """

    def __init__(self, interval: float) -> None:
        self.state = State.CLOSED
        self._interval = interval
        self._data = bytearray()
        self._owner = 0
        self._count = 0
        self._wanted: tuple[int, ...] | None = None
        self._shown: tuple[int, ...] | None = None
        self._uploaded = float("-inf")
        self._sent = 0.0
        self._logged: set[str] = set()

    def on_connect(self) -> None:
        """Begin a connection; the player speaks first."""
        assert self.state is State.CLOSED, "connected already"
        self._data.clear()
        self._owner = self._count = 0
        self._shown = None  # it may be another player
        self._uploaded = float("-inf")
        self._logged.clear()
        self._go(State.GREETING)

    def on_disconnect(self) -> None:
        """End the connection."""
        self._go(State.CLOSED)

    def show(self, values: Sequence[int]) -> None:
        """Set the frame to show, 68 integers in the FAPs' units, instead of one not sent yet."""
        self._wanted = tuple(values)

    def receive(self, data: bytes) -> None:
        """Parse data from the player."""
        self._data += data
        for note in read_notes(self._data):
            if note.name == "CONNECTION_OK" and self.state is State.GREETING:
                self._owner = note.owner
                self._go(State.READY)
            elif self.state in _WAITING and note.id == self._number and note.status in _ENDED:
                if note.status == Status.ERROR:
                    self._log_once(f"it cannot do {note.name}")
                self._ended()
            elif note.name == "ERROR":
                self._log_once("it does not understand a task")

    def due(self, now: float) -> bytes | None:
        """Return the task to send now, by itself, or None."""
        if self.state in _WAITING and now >= self._sent + PATIENCE:
            self._log_once("no note about a task; going on")
            self._ended()
        if self.state is State.UPLOADED:
            self._go(State.STOPPING)
            self._sent = now
            return self._task("STOP_PLAYBACK")
        if self.state is not State.READY or self._wanted in (None, self._shown):
            return None
        if now < self._uploaded + self._interval:
            return None
        assert self._wanted is not None
        self._shown, self._uploaded, self._sent = self._wanted, now, now
        self._go(State.UPLOADING)
        return self._task("UPLOAD_FAP", _file(self._wanted))

    def next_deadline(self) -> float | None:
        """Return when to call `due` again if nothing else happens, or None."""
        if self.state in _WAITING:
            return self._sent + PATIENCE
        if self.state is State.READY and self._wanted not in (None, self._shown):
            return self._uploaded + self._interval
        return None

    @property
    def _number(self) -> int:
        return self._owner * NUMBERS + self._count

    def _task(self, name: str, *params: str) -> bytes:
        self._count += 1
        return pack_task(Task(name, self._owner, self._number, params))

    def _ended(self) -> None:
        self._go(State.UPLOADED if self.state is State.UPLOADING else State.READY)

    def _log_once(self, words: str) -> None:
        """Log a warning once for each connection, as it may concern every frame."""
        if words not in self._logged:
            self._logged.add(words)
            log.warning("xface player: %s", words)

    def _go(self, state: State) -> None:
        log.debug("xface player: %s", state.value)
        self.state = state


def _file(values: tuple[int, ...]) -> str:
    """Return a FAP file of one frame with the FAPs that are not 0; the player sets the others to neutral."""
    row = np.array([values], np.float32)
    return encode(FAPClip.of(FAPFrames(np.zeros(1), row, row[0] != 0), 25.0, "realizer"))


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

    unsent_bytes = 0  # only the last frame is stored

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.xface_player is not None
        super().__init__("xface player", settings.xface_player)
        self._session = settings.xface_player_session
        self.startup_lines = (f"xface player: {self._peer} shows session {self._session}",)
        self._sessions = sessions
        self._link = PlayerLink(settings.xface_player_interval)
        self._writer: asyncio.StreamWriter | None = None
        self._timer: asyncio.TimerHandle | None = None

    # the session's side --------------------------------------------------------------------------

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
