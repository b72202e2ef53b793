"""The renderer: pictures of poses, drawn by a child process that is restarted if it dies."""

import os
import threading
from collections.abc import Iterator
from functools import cached_property
from typing import Any, Self

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.errors import RenderError
from realizer.face.model import Face
from realizer.render.backdrop import background_of, channels
from realizer.render.drawing_process import DRAW, DrawingProcess, Open, Pixels

HALF = 8  # frames in half the shared memory: one half is drawn while the other is used
HALF_BYTES = 32 << 20  # and at most this much of it


class Renderer:
    """Draws a face, in a process of its own that holds the GL context.

    The process starts at the first picture, or at `start`, and dies with us. If it crashes, the call that
    noticed raises RenderError and the next call starts a new one. May be called from any thread, one call at
    a time.
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
        backend: str | None = None,
        deformer: str | None = None,
    ) -> None:
        """Prepare; nothing is started.

        Args:
            face: name of a face folder, or a Face (then it is sent over).
            size: width, height in pixels.
            camera: a preset, or a camera of the face.
            light: a preset; None selects REALIZER_LIGHT, then "portrait".
            background: "#rrggbb", "transparent" or the path of a picture (PNG, JPEG, WebP); None selects
                REALIZER_BACKGROUND, then the light's own.
            alpha: the caller takes pictures of four channels, should REALIZER_BACKGROUND say "transparent".
            backend: "gl", "onboard" or "auto"; None selects REALIZER_DRAW, then "auto".
            deformer: of a face that is given by name, "mpeg4" or "au"; None is its own default.
        """
        width, height = size
        if not (1 <= width <= 8192 and 1 <= height <= 8192):
            raise ValueError(f"size: wanted 1..8192 pixels each way, got {width}x{height}")
        self.face, self.size, self.camera, self.deformer = face, size, camera, deformer
        self.light, self._background, self._alpha = light, background, alpha
        self.backend = backend or os.environ.get(DRAW) or "auto"
        self._half = max(1, min(HALF, HALF_BYTES // (width * height * 4)))
        self._lock = threading.Lock()
        self._process: DrawingProcess | None = None

    def start(self) -> None:
        """Start the process before there is anything to draw; its errors are raised by the first picture.

        Raises:
            RenderError: `background` is none.
        """
        with self._lock:
            self._started()

    def draw(self, poses: Float32) -> UInt8:
        """Return (n, h, w, 3) uint8, (n, h, w, 4) where transparent, row 0 at the top, of (n, k) poses.

        Args:
            poses: as `face.deform` takes them: a column for each of `Face.inputs`, or (n, 68) FAPs alone.

        Raises:
            ValueError: another shape.
            FaceError: no such face.
            RenderError: no GL, no such camera, or the process died; says what to do.
        """
        rows = self._rows(poses)
        pixels = np.empty((len(rows), self.size[1], self.size[0], channels(self.background)), np.uint8)
        for k, picture in enumerate(self.frames(rows)):
            pixels[k] = picture
        return pixels

    def frames(self, poses: Float32) -> Iterator[UInt8]:
        """Yield the picture of each of (n, k) poses, (h, w, 3) uint8; the next ones are drawn meanwhile.

        A picture is valid until the next one is requested. Exhaust the iterator, or close it, before
        you ask this renderer for anything else. Errors as `draw`.
        """
        rows = self._rows(poses)
        pieces = [rows[i : i + self._half] for i in range(0, len(rows), self._half)]
        with self._lock:
            process = self._ready()
            waiting = 0
            try:
                for k, piece in enumerate(pieces[:2]):
                    process.send(("draw", piece, k * self._half))
                    waiting += 1
                for k, piece in enumerate(pieces):
                    process.receive()
                    waiting -= 1
                    first = k % 2 * self._half
                    yield from process.pixels.array[first : first + len(piece)]
                    if k + 2 < len(pieces):
                        process.send(("draw", pieces[k + 2], first))
                        waiting += 1
            except RenderError:
                waiting = 0
                self._drop()
                raise
            finally:
                for _ in range(waiting):  # the caller left early: at most two answers are still to come
                    process.receive()

    def encoded(self, pose: Float32, form: str = "jpeg", quality: int = 85) -> bytes:
        """Return the bytes of a picture of one pose, (k,).

        Args:
            form: "jpeg", "png" or "webp"; the latter two are transparent where the background is.
            quality: 1..100, of a JPEG or a WebP.

        Errors as `draw`.
        """
        (row,) = self._rows(np.asarray(pose)[None])
        with self._lock:
            process = self._ready()
            try:
                process.send(("encode", row, form, quality))
                encoded: bytes = process.receive()
            except RenderError:
                self._drop()
                raise
        return encoded

    @property
    def background(self) -> str | None:
        """The background; None is the light's own gradient.

        Raises:
            RenderError: neither a colour, nor "transparent", nor an existing file.
        """
        return background_of(self._background, alpha=self._alpha)

    @property
    def pid(self) -> int | None:
        """The drawing process, while there is one."""
        return None if self._process is None else self._process.pid

    def close(self) -> None:
        """End the process. A later call would start a new one."""
        with self._lock:
            self._drop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _started(self) -> DrawingProcess:
        if self._process is None:
            slots, behind = 2 * self._half, self.background
            names = self.light, self.backend, behind, self.deformer
            with Pixels.create(slots, self.size, channels(behind)) as memory:
                order = Open(self.face, self.size, self.camera, memory.fileno(), slots, *names)
                self._process = DrawingProcess(order)
        return self._process

    def _ready(self) -> DrawingProcess:
        process = self._started()
        try:
            process.open()
        except BaseException:
            self._drop()
            raise
        return process

    def _drop(self) -> None:
        if self._process is not None:
            self._process.end()
            self._process = None

    def _rows(self, poses: Any) -> Float32:
        from realizer.face.deform import complete_poses

        return complete_poses(poses, self._inputs)

    @cached_property
    def _inputs(self) -> tuple[str, ...]:
        from realizer.face.load import input_names

        return (
            input_names(self.face, deformer=self.deformer) if isinstance(self.face, str) else self.face.inputs
        )
