"""Messages between the drawing process and its owner, and their shared memory."""

import mmap
import os
import tempfile
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import IO

import numpy as np

from realizer.core.array_types import UInt8
from realizer.face.model import Face


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
