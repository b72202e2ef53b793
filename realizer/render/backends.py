"""The drawing backends: OpenGL if there is a graphics card, the processor if not."""

from pathlib import Path

from realizer.core.errors import RenderError
from realizer.face.model import Face
from realizer.render.cameras import Camera
from realizer.render.canvas import Canvas
from realizer.render.light import Light

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
    from realizer.render.software import SoftwareCanvas

    return SoftwareCanvas
