"""The drawing backends: OpenGL if there is a graphics card, the processor if not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol

from realizer.core.array_types import Float32, UInt8
from realizer.core.errors import RenderError
from realizer.face.model import Face
from realizer.render.cameras import Camera
from realizer.render.light import Light

BACKENDS = ("auto", "gl", "onboard")
# Files that Linux shows where a graphics card may be used. Without one, OpenGL is drawn by the processor too,
# half as fast as we do.
CARDS = ("dri/renderD*", "nvidia[0-9]*", "dxg")


class Drawer(Protocol):
    """The interface of canvases."""

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """Return (h, w, 3) uint8, (h, w, 4) where transparent, of (n, 3) vertices and unit normals."""

    def close(self) -> None:
        """Release the canvas's resources."""


def open_canvas(
    face: Face,
    size: tuple[int, int],
    camera: Camera,
    light: Light,
    background: str | None = None,
    backend: str = "auto",
) -> tuple[str, Drawer]:
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
            return name, OPENERS[name](face, size, camera, light, background)
        except RenderError as error:
            faults.append(str(error))
    raise RenderError("; or: ".join(faults))


def _order(devices: Path) -> tuple[str, ...]:
    card = any(any(devices.glob(pattern)) for pattern in CARDS)
    return ("gl", "onboard") if card else ("onboard", "gl")


def _gl(face: Face, size: tuple[int, int], camera: Camera, light: Light, background: str | None) -> Drawer:
    from realizer.render.opengl import OpenGLCanvas

    return OpenGLCanvas(face, size, camera, light, background)


def _software(
    face: Face, size: tuple[int, int], camera: Camera, light: Light, background: str | None
) -> Drawer:
    from realizer.render.raster import ready
    from realizer.render.software import SoftwareCanvas

    if fault := ready():
        raise RenderError(fault)
    return SoftwareCanvas(face, size, camera, light, background)


OPENERS: Mapping[str, Callable[[Face, tuple[int, int], Camera, Light, str | None], Drawer]] = {
    "gl": _gl,
    "onboard": _software,
}
