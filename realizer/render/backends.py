"""The drawing backends: OpenGL if there is a graphics card, the processor if not."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.errors import RenderError
from realizer.face.model import Face
from realizer.render.backdrop import backdrop, channels, over
from realizer.render.cameras import Camera
from realizer.render.light import Light
from realizer.render.shaded_mesh import ShadedMesh

BACKENDS = ("auto", "gl", "onboard")
# Files that Linux shows where a graphics card may be used. Without one, OpenGL is drawn by the processor too,
# half as fast as we do.
CARDS = ("dri/renderD*", "nvidia[0-9]*", "dxg")


class Canvas(ABC):
    """A head that a backend draws again and again."""

    def __init__(
        self, face: Face, size: tuple[int, int], camera: Camera, light: Light, background: str | None = None
    ) -> None:
        """Prepare; `background` as `realizer.render.backdrop.backdrop` takes it.

        Raises:
            RenderError: the backend is missing here; the text says what to install.
        """
        self._size, self._camera, self._figure = size, camera, ShadedMesh(face, camera, light)
        self._backdrop, self._channels = backdrop(size, light, background), channels(background)
        self._open()

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """Return (h, w, 3) uint8, (h, w, 4) where transparent, row 0 at the top; in `out` if that is given.

        Args:
            vertices, normals: (n, 3) metres and unit vectors.
        """
        self._figure.pose(vertices, normals)
        if out is None:
            out = np.empty((*self._size[::-1], self._channels), np.uint8)
        return over(self._pixels(), self._backdrop, out)

    @abstractmethod
    def close(self) -> None:
        """Release the canvas's resources."""

    @abstractmethod
    def _open(self) -> None:
        """Prepare to draw `_figure`."""

    @abstractmethod
    def _pixels(self) -> UInt8:
        """Return `_figure` as (h, w, 4) premultiplied."""


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
    from realizer.render.software import SoftwareCanvas

    return SoftwareCanvas
