"""FAP rows in, pixels or JPEG out, by a drawing process that is started, watched and replaced here."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import weakref
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

import realizer
from realizer.arrays import Float32, UInt8
from realizer.errors import RenderError
from realizer.face.model import Face

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from realizer.render.wire import Message, Open, Pixels

__all__ = ["Renderer", "available"]

HALF = 8  # frames in half the shared memory: one half is drawn while the other is used
HALF_BYTES = 32 << 20  # and at most this much of it
DRAW = "REALIZER_DRAW"
PATIENCE = 60.0  # s; the longest answer, a start on a cold disk, takes about 3


class Renderer:
    """Draws a face, in a process of its own that holds the GL context.

    The process starts at the first picture and dies with us. If it crashes, the call that noticed raises
    RenderError and the next call starts a new one. May be called from any thread, one call at a time.
    """

    def __init__(
        self,
        face: str | Face = "default",
        size: tuple[int, int] = (512, 512),
        camera: str = "front",
        *,
        light: str | None = None,
        background: str | None = None,
        alpha: bool = False,
        way: str | None = None,
    ) -> None:
        """Nothing starts yet.

        Args:
            face: name of a face folder, or a Face (then it is sent over).
            size: width, height in pixels.
            camera: a preset, or a camera of the face.
            light: a preset; None is what REALIZER_LIGHT says, or "portrait".
            background: "#rrggbb" or "transparent"; None is what REALIZER_BACKGROUND says, or the light's own.
            alpha: the caller takes pictures of four channels, should REALIZER_BACKGROUND say "transparent".
            way: "gl", "onboard" or "auto"; None is what REALIZER_DRAW says, or "auto".
        """
        width, height = size
        if not (1 <= width <= 8192 and 1 <= height <= 8192):
            raise ValueError(f"size: wanted 1..8192 pixels each way, got {width}x{height}")
        self.face, self.size, self.camera = face, size, camera
        self.light, self._background, self._alpha = light, background, alpha
        self.way = way or os.environ.get(DRAW) or "auto"
        self._half = max(1, min(HALF, HALF_BYTES // (width * height * 4)))
        self._lock = threading.Lock()
        self._process: _Process | None = None

    def draw(self, faps: Float32) -> UInt8:
        """(n, h, w, 3) uint8, (n, h, w, 4) where transparent, row 0 at the top, of (n, 68) FAPs.

        Raises:
            ValueError: not (n, 68).
            RenderError: no GL, no such face or camera, or the process died; says what to do.
        """
        from realizer.render.backdrop import channels

        rows = _rows(faps)
        pixels = np.empty((len(rows), self.size[1], self.size[0], channels(self.background)), np.uint8)
        for k, picture in enumerate(self.frames(rows)):
            pixels[k] = picture
        return pixels

    def frames(self, faps: Float32) -> Iterator[UInt8]:
        """Each picture of (n, 68) FAPs, (h, w, 3) uint8; the next ones are drawn while you use this one.

        A picture is valid until the next one is asked for. Run the iterator to its end, or close it, before
        you ask this renderer for anything else. Errors as `draw`.
        """
        from realizer.render.wire import Draw

        rows = _rows(faps)
        pieces = [rows[i : i + self._half] for i in range(0, len(rows), self._half)]
        with self._lock:
            process = self._started()
            waiting = 0
            try:
                for k, piece in enumerate(pieces[:2]):
                    process.send(Draw(piece, k * self._half))
                    waiting += 1
                for k, piece in enumerate(pieces):
                    process.receive()
                    waiting -= 1
                    first = k % 2 * self._half
                    yield from process.pixels.array[first : first + len(piece)]
                    if k + 2 < len(pieces):
                        process.send(Draw(pieces[k + 2], first))
                        waiting += 1
            except RenderError:
                waiting = 0
                self._drop()
                raise
            finally:
                for _ in range(waiting):  # the caller left early: at most two answers are still to come
                    process.receive()

    def jpeg(self, faps: Float32, quality: int = 85) -> bytes:
        """JPEG bytes of one row, (68,). Errors as `draw`."""
        from realizer.render.wire import Jpeg

        (row,) = _rows(np.asarray(faps)[None])
        with self._lock:
            process = self._started()
            try:
                process.send(Jpeg(row, quality))
                encoded: bytes = process.receive()
            except RenderError:
                self._drop()
                raise
        return encoded

    @property
    def background(self) -> str | None:
        """What stands behind: None is the light's own gradient.

        Raises:
            RenderError: neither a colour nor "transparent".
        """
        from realizer.render.backdrop import colour_of

        return colour_of(self._background, alpha=self._alpha)

    @property
    def pid(self) -> int | None:
        """The drawing process, while there is one."""
        return None if self._process is None else self._process.pid

    def close(self) -> None:
        """End the process. A later call would start a new one."""
        with self._lock:
            self._drop()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _started(self) -> _Process:
        if self._process is None:
            from realizer.render.backdrop import channels
            from realizer.render.wire import Open, Pixels

            slots = 2 * self._half
            behind = self.background
            path = Pixels.create(slots, self.size, channels(behind))
            order = Open(self.face, self.size, self.camera, path, slots, self.light, self.way, behind)
            self._process = _Process(order)
        return self._process

    def _drop(self) -> None:
        if self._process is not None:
            self._process.end()
            self._process = None


class _Process:
    """One drawing process that has opened its canvas."""

    pixels: Pixels

    def __init__(self, order: Open) -> None:
        from realizer.render.backdrop import channels
        from realizer.render.wire import Pixels, connection

        try:
            self._popen = subprocess.Popen(
                _command(), stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=_environment()
            )
            assert self._popen.stdin is not None
            assert self._popen.stdout is not None
            self._orders = connection(self._popen.stdin.fileno(), writes=True)
            self._answers = connection(self._popen.stdout.fileno(), writes=False)
            self._popen.stdin.close()
            self._popen.stdout.close()
            self._end = weakref.finalize(self, _end, self._popen, self._orders, self._answers)
            self.pid = self._popen.pid
            try:
                self.pixels = Pixels(order.memory, order.slots, order.size, channels(order.background))
                self.send(order)
                self.way = self.receive()
            except BaseException:
                self.end()
                raise
        finally:
            Path(order.memory).unlink()

    def send(self, message: Message) -> None:
        try:
            self._orders.send(message)
        except OSError:
            raise self._died() from None

    def receive(self) -> Any:
        from realizer.render.wire import Failed

        try:
            if not self._answers.poll(PATIENCE):
                raise RenderError(f"the drawing process gave no picture within {PATIENCE:g} s")
            answer = self._answers.recv()
        except (EOFError, OSError):
            raise self._died() from None
        if isinstance(answer, Failed):
            raise RenderError(answer.says)
        return answer

    def end(self) -> None:
        self._end()

    def _died(self) -> RenderError:
        try:
            code: int | None = self._popen.wait(5)
        except subprocess.TimeoutExpired:
            code = None
        return RenderError(f"the drawing process ended (exit status {code}); the next call starts a new one")


def _end(popen: subprocess.Popen[bytes], orders: Connection, answers: Connection) -> None:
    """Hang up, and insist where that does not help."""
    orders.close()
    answers.close()
    try:
        popen.wait(0.5)
    except subprocess.TimeoutExpired:
        popen.kill()
        popen.wait()


def available(way: str | None = None) -> str | None:
    """None where pictures can be drawn, that way; otherwise a sentence that says what to install."""
    return asked(way)[1]


@cache
def asked(way: str | None = None) -> tuple[str, str | None]:
    """The way pictures are drawn here, and None; or "" and what to install. Asks a new process, once."""
    done = subprocess.run(
        [*_command(), "--check", way or os.environ.get(DRAW) or "auto"],
        env=_environment(),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    said = (done.stdout.strip() or done.stderr.strip()).splitlines()
    if done.returncode == 0:
        return said[-1], None
    return "", said[-1] if said else f"the drawing process ended (exit status {done.returncode})"


def _command() -> list[str]:
    return [sys.executable, "-P", "-m", "realizer.render.worker"]


def _environment() -> dict[str, str]:
    """Ours, with our package first, and one thread for linear algebra: 0.8 ms a frame instead of 7.5."""
    ours = str(Path(realizer.__path__[0]).parent)
    paths = [ours, *filter(None, [os.environ.get("PYTHONPATH")])]
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    return {**os.environ, **threads, "PYTHONPATH": os.pathsep.join(paths)}


def _rows(faps: Any) -> Float32:
    rows = np.ascontiguousarray(faps, np.float32)
    if rows.ndim != 2 or rows.shape[1] != 68:
        raise ValueError(f"faps: wanted (n, 68), got {rows.shape}")
    return rows
