"""The drawing process: poses on stdin, pixels in shared memory, files on stdout; by OpenGL or without it."""

import os
import signal
import sys
from collections.abc import Iterator, Mapping
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.errors import RealizerError, RenderError
from realizer.face.model import Face, Fapu
from realizer.render.backdrop import channels
from realizer.render.cameras import Camera, camera_for
from realizer.render.canvas import Canvas
from realizer.render.drawing_process import Failed, Open, Pixels, connection
from realizer.render.light import Light, preset

BACKENDS = ("auto", "gl", "onboard")
# Files that Linux shows where a graphics card may be used. Without one, OpenGL is drawn by the processor too,
# less than half as fast as we do.
CARDS = ("dri/renderD*", "nvidia[0-9]*", "dxg")


def open_canvas(
    face: Face,
    size: tuple[int, int],
    camera: Camera,
    light: Light,
    background: str | None = None,
    backend: str = "auto",
) -> tuple[str, Canvas]:
    """Return the name of the backend that works, and its canvas.

    Args:
        background: as `realizer.render.backdrop.backdrop` takes it.
        backend: one of BACKENDS; "auto" selects the faster one here, or the other if that is missing.

    Raises:
        RenderError: unknown backend, or it is missing here; the text says what to install.
    """
    if backend not in BACKENDS:
        raise RenderError(f"drawing: wanted one of {', '.join(BACKENDS)}, got {backend!r}")
    faults = []
    for name in _order(Path("/dev")) if backend == "auto" else (backend,):
        try:
            return name, _canvas(name)(face, size, camera, light, background)
        except RenderError as error:
            faults.append(str(error))
    raise RenderError("; or: ".join(faults))


def _order(devices: Path) -> tuple[str, ...]:
    card = any(any(devices.glob(pattern)) for pattern in CARDS)
    return ("gl", "onboard") if card else ("onboard", "gl")


def _canvas(backend: str) -> type[Canvas]:
    if backend == "gl":
        from realizer.render.opengl import OpenGLCanvas

        return OpenGLCanvas
    from realizer.render.raster import SoftwareCanvas

    return SoftwareCanvas


BATCH = 16  # frames deformed in one call: many share its fixed cost, and few stay in the processor's cache
# Pillow's fastest options for streams. A PNG of level 1 is a fifth larger than one of the default level 6.
FASTEST: Mapping[str, Mapping[str, int]] = {"jpeg": {}, "png": {"compress_level": 1}, "webp": {"method": 0}}


class FaceDrawer:
    """A face with a canvas, and the shared memory of its pictures."""

    def __init__(self, order: Open) -> None:
        from realizer.face.load import load_face

        self.pixels = Pixels(order.memory, order.slots, order.size, channels(order.background))
        face = order.face
        self.face = load_face(face, deformer=order.deformer) if isinstance(face, str) else face
        camera, light = camera_for(self.face, order.camera).fitted(order.size), preset(order.light)
        self.backend, self.canvas = open_canvas(
            self.face, order.size, camera, light, order.background, order.backend
        )

    def draw(self, rows: Float32, first: int) -> int:
        """Draw poses (n, k) into the slots from `first` on; return n."""
        slots = self.pixels.array[first : first + len(rows)]
        for (vertices, normals), out in zip(shapes(self.face, rows), slots, strict=True):
            self.canvas.draw(vertices, normals, out)
        return len(rows)

    def encode(self, row: Float32, form: str, quality: int) -> bytes:
        """Return the bytes of a picture of a pose (k,), as `encode`."""
        ((vertices, normals),) = shapes(self.face, row[None])
        return encode(self.canvas.draw(vertices, normals), form, quality)


def shapes(face: Face, rows: Float32) -> Iterator[tuple[Float32, Float32]]:
    """Yield vertices and normals, (n_vertices, 3) each, of each of (n, k) poses."""
    from realizer.face.deform import deform
    from realizer.face.surface import normals

    for first in range(0, len(rows), BATCH):
        vertices = deform(face, rows[first : first + BATCH])
        yield from zip(vertices, normals(face, vertices), strict=True)


def encode(pixels: UInt8, form: str, quality: int) -> bytes:
    """Return an image file of pixels (h, w, 3 or 4) uint8; a JPEG has no alpha channel."""
    if form == "jpeg":
        pixels = np.ascontiguousarray(pixels[..., :3])
        try:
            import simplejpeg  # twice as fast as Pillow
        except ModuleNotFoundError:
            pass
        else:
            encoded: bytes = simplejpeg.encode_jpeg(
                pixels, quality=quality, colorspace="RGB", colorsubsampling="420"
            )
            return encoded
    import io

    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, form, **{"quality": quality, **FASTEST[form]})
    return buffer.getvalue()


def serve(orders: Connection, answers: Connection) -> None:
    """Answer messages until the owner closes the pipe or ends, or an error occurs."""
    drawer: FaceDrawer | None = None
    owner = os.getppid()
    while True:
        # A child of the owner may have inherited the pipe and keep it open, so check the parent's id, too.
        while not orders.poll(2.0):
            if os.getppid() != owner:
                return
        try:
            message = orders.recv()
        except EOFError:
            return
        try:
            if drawer is None:
                drawer = FaceDrawer(message)
                result = drawer.backend
            else:
                name, *arguments = message
                result = getattr(drawer, name)(*arguments)
        except RealizerError as error:
            answers.send(Failed(str(error)))
            return
        except Exception as error:
            answers.send(Failed(f"drawing failed: {type(error).__name__}: {error}"))
            raise
        answers.send(result)


def triangle() -> Face:
    """Return a face of three vertices, without FAPs."""
    vertices = np.eye(3, dtype=np.float32)
    return Face(
        name="triangle",
        source="",
        licence="",
        vertices=vertices,
        triangles=np.array([[0, 1, 2]], np.int32),
        colours=np.full((3, 3), 200, np.uint8),
        occlusion=np.ones(3, np.float32),
        gloss=np.zeros(3, np.float32),
        parts={"skin": (0, 3)},
        feature_points={"2.1": 0, "11.1": 1},
        points={"2.1": vertices[0], "11.1": vertices[1]},
        fapu=Fapu(0.012, 0.064, 0.05, 0.03, 0.05),
        basis={},
    )


def check(backend: str) -> int:
    """Draw one triangle; print the backend, or print what is missing and return 3."""
    face = triangle()
    try:
        name, canvas = open_canvas(face, (16, 16), camera_for(face), preset(), backend=backend)
        canvas.draw(face.vertices, np.zeros_like(face.vertices))
        canvas.close()
    except RenderError as error:
        print(error)
        return 3
    print(name)
    return 0


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--check"]:
        return check(*arguments[1:])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the owner
    orders = connection(0, writes=False)
    answers = connection(1, writes=True)
    os.dup2(2, 1)  # output of libraries must not mix with the answers
    try:
        serve(orders, answers)
    except BrokenPipeError:
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
