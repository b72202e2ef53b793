"""The child process that draws, and the check of what this machine can draw with."""

import mmap
import os
import subprocess
import sys
import tempfile
import threading
import weakref
from dataclasses import dataclass
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any

import numpy as np

from realizer.core.array_types import UInt8
from realizer.core.errors import RenderError
from realizer.core.threads import SINGLE_THREAD
from realizer.face.model import Face
from realizer.render.backdrop import channels

# s; the first check in a new installation compiles, which takes a minute on a free core.
CHECK_LIMIT = 600


@dataclass(frozen=True)
class Open:
    """The first message: what to draw, and the descriptor of the shared memory. The answer names the backend.

    All others are the name of a method of `worker.FaceDrawer` and its arguments.
    """

    face: str | Face
    size: tuple[int, int]
    camera: str
    memory: int
    slots: int
    light: str | None
    backend: str
    background: str | None
    deformer: str | None = None


@dataclass(frozen=True)
class Failed:
    """The answer to any message that went wrong; the process ends after it."""

    message: str


class Pixels:
    """(slots, h, w, 3 or 4) uint8 in memory that two processes map.

    The file has no name, so killed processes leave nothing behind; `multiprocessing.shared_memory` would
    leave its segment, or a warning about it.
    """

    def __init__(self, descriptor: int, slots: int, size: tuple[int, int], channels: int = 3) -> None:
        width, height = size
        self._map = mmap.mmap(descriptor, slots * height * width * channels)
        self.array: UInt8 = np.frombuffer(self._map, np.uint8).reshape(slots, height, width, channels)

    @staticmethod
    def create(slots: int, size: tuple[int, int], channels: int = 3) -> IO[bytes]:
        """Return a new file of the right length, in memory if the system has such a folder."""
        file = tempfile.TemporaryFile(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None)  # noqa: SIM115
        file.truncate(slots * size[0] * size[1] * channels)
        return file


def connection(descriptor: int, *, writes: bool) -> Connection:
    """Return a message pipe over its own copy of a descriptor."""
    return Connection(os.dup(descriptor), readable=not writes, writable=writes)


DRAW = "REALIZER_DRAW"  # the variable that names a way of drawing
PATIENCE = 180.0  # s; a first start compiles for about 10, on a busy machine for more than 60


class DrawingProcess:
    """A drawing process, which opens its canvas while its owner continues."""

    def __init__(self, order: Open) -> None:
        if os.name == "nt":
            raise RenderError("pictures are drawn by a process that shares files: wanted Linux or macOS")
        self._opened = threading.Event()
        self.pixels = Pixels(order.memory, order.slots, order.size, channels(order.background))
        self._popen = subprocess.Popen(
            _command(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
            pass_fds=(order.memory,),
        )
        assert self._popen.stdin is not None
        assert self._popen.stdout is not None
        self._orders = connection(self._popen.stdin.fileno(), writes=True)
        self._answers = connection(self._popen.stdout.fileno(), writes=False)
        self._popen.stdin.close()
        self._popen.stdout.close()
        self.pid = self._popen.pid
        self.end = weakref.finalize(self, _end, self._popen, self._orders, self._answers, self._opened)
        self.send(order)

    def open(self) -> None:
        """Wait until it can draw; does nothing the second time.

        Raises:
            RenderError: it cannot; says why.
        """
        if not self._opened.is_set():
            self.receive()
            self._opened.set()

    def send(self, message: Open | tuple[Any, ...]) -> None:
        try:
            self._orders.send(message)
        except OSError:
            raise self._died() from None

    def receive(self) -> Any:
        try:
            if not self._answers.poll(PATIENCE):
                raise RenderError(f"the drawing process gave no picture within {PATIENCE:g} s")
            answer = self._answers.recv()
        except (EOFError, OSError):
            raise self._died() from None
        if isinstance(answer, Failed):
            raise RenderError(answer.message)
        return answer

    def _died(self) -> RenderError:
        try:
            code: int | None = self._popen.wait(5)
        except subprocess.TimeoutExpired:
            code = None
        return RenderError(f"the drawing process ended (exit status {code}); the next call starts a new one")


def _end(
    popen: subprocess.Popen[bytes], orders: Connection, answers: Connection, opened: threading.Event
) -> None:
    """Close the pipes and kill the process if it does not end."""
    orders.close()
    answers.close()
    try:
        popen.wait(0.5 if opened.is_set() else 0)
    except subprocess.TimeoutExpired:
        popen.kill()
        popen.wait()


def unavailable_reason(backend: str | None = None) -> str | None:
    """Return None if the backend can draw here, or a sentence that says what to install."""
    return available_backend(backend)[1]


@cache
def available_backend(backend: str | None = None) -> tuple[str, str | None]:
    """Return the backend that draws here and None, or "" and what to install. Cached."""
    done = subprocess.run(
        [*_command(), "--check", backend or os.environ.get(DRAW) or "auto"],
        env=_environment(),
        capture_output=True,
        text=True,
        timeout=CHECK_LIMIT,
        check=False,
    )
    lines = (done.stdout.strip() or done.stderr.strip()).splitlines()
    if done.returncode == 0:
        return lines[-1], None
    return "", lines[-1] if lines else f"the drawing process ended (exit status {done.returncode})"


def _command() -> list[str]:
    return [sys.executable, "-P", "-m", "realizer.render.worker"]


def _environment() -> dict[str, str]:
    """Return our environment with our package first and one thread for linear algebra (9 times faster)."""
    ours = str(Path(__file__).parents[2])
    paths = [ours, *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, **SINGLE_THREAD, "PYTHONPATH": os.pathsep.join(paths)}
