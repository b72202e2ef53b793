"""The protocol of an Xface player (Paul 2010): states and messages."""

import logging
from collections.abc import Sequence
from enum import Enum

import numpy as np

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.frames import FAPFrames
from realizer.outputs.fap_text import encode
from realizer.server.transports.xface.wire import Status, Task, pack_task, read_notes

log = logging.getLogger(__name__)

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
