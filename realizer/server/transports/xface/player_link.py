"""The protocol of an Xface player (Paul 2010): states and messages."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from enum import Enum

import numpy as np

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.frames import FAPFrames
from realizer.outputs.fap_text import encode
from realizer.server.transports.xface.wire import Status, Task, pack_task, read_notes

log = logging.getLogger(__name__)

# s; a player that says nothing of a task for so long has lost it, and is sent the next one.
PATIENCE = 2.0
# Clients of the player number their tasks from here, times their own number.
NUMBERS = 1_000_000
_ENDED = (Status.FINISHED, Status.ERROR)


class State(Enum):
    """Where the link is: a task goes out only in READY, and only one at a time."""

    CLOSED = "not connected"
    GREETING = "connected, not greeted yet"
    READY = "nothing on its way"
    UPLOADING = "a frame is on its way"
    UPLOADED = "a frame is there, and not shown"
    STOPPING = "the stop that shows it is on its way"


_WAITING = (State.UPLOADING, State.STOPPING)


class PlayerLink:
    """One player, which shows a frame only when it is told to stop (Paul 2010, 4.2.2).

    A frame is a FAP file of one, uploaded; then comes STOP_PLAYBACK. Each waits for the note that the one
    before is done: the player takes two tasks in one read for one. Of frames that come meanwhile the last is
    what counts.

    Args:
        interval: least seconds from one upload to the next. Paul found that the player stops showing anything
            at shorter ones than 0.25.
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
        self._told: set[str] = set()

    def on_connect(self) -> None:
        """A connection stands; the player speaks first."""
        assert self.state is State.CLOSED, "connected already"
        self._data.clear()
        self._owner = self._count = 0
        self._shown = None  # it may be another player
        self._uploaded = float("-inf")
        self._told.clear()
        self._go(State.GREETING)

    def on_disconnect(self) -> None:
        """The connection is gone."""
        self._go(State.CLOSED)

    def show(self, values: Sequence[int]) -> None:
        """This frame, 68 whole numbers in each FAP's FAPU, in place of any that was not sent yet."""
        self._wanted = tuple(values)

    def receive(self, data: bytes) -> None:
        """What the player said."""
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
        """The task to send now, if there is one; it is to be sent whole, by itself."""
        if self.state in _WAITING and now >= self._sent + PATIENCE:
            self._log_once("it says nothing of a task; going on")
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
        """When `due` is to be asked again, where nothing else happens; None: not before then."""
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
        """The task on its way is done, or lost."""
        self._go(State.UPLOADED if self.state is State.UPLOADING else State.READY)

    def _log_once(self, what: str) -> None:
        """Once for each connection: it may be so of every frame."""
        if what not in self._told:
            self._told.add(what)
            log.warning("xface player: %s", what)

    def _go(self, state: State) -> None:
        log.debug("xface player: %s", state.value)
        self.state = state


def _file(values: tuple[int, ...]) -> str:
    """A FAP file of one frame, with every FAP that is not 0: what the player is not given is neutral."""
    row = np.array([values], np.float32)
    return encode(FAPClip.of(FAPFrames(np.zeros(1), row, row[0] != 0), 25.0, "realizer"))
