"""The OpenGL backend; the only importer of pyrender."""

import os
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.errors import RenderError
from realizer.face.subdivision import subdivided
from realizer.render.canvas import Canvas, ShadedMesh

NO_LIBRARY = "pictures need the render extra: pip install 'bml-realizer[render]'"
NO_GL = "pictures need OpenGL: install Debian packages libegl1 and libgl1"


class OpenGLCanvas(Canvas):
    """A canvas that draws with OpenGL.

    It belongs to the thread that made it, as its GL context does; a process has at most one. Light is
    computed for each vertex with numpy, which is four times as fast as a shader on a software GL.
    """

    def _open(self) -> None:
        pyrender = _pyrender()
        self._smooth = subdivided(self._face)
        self._figure = ShadedMesh(self._smooth.face, self._camera, self._light)
        vertices = self._figure.points
        # x y z r g b a: the layout of pyrender's buffer of positions and colours.
        self._interleaved = np.ones((len(vertices), 7), np.float32)
        material = pyrender.MetallicRoughnessMaterial(baseColorFactor=[1.0, 1.0, 1.0, 1.0])
        # Colours must be floats: pyrender takes integers 0/1 for 0..255 and draws black.
        colours = np.ones((len(vertices), 4), np.float32)
        self._head = pyrender.Primitive(
            vertices, color_0=colours, indices=self._figure.triangles, material=material
        )
        self._scene = pyrender.Scene(bg_color=[0.0, 0.0, 0.0, 0.0])
        self._scene.add(pyrender.Mesh([self._head]))
        camera = self._camera
        lens = pyrender.PerspectiveCamera(yfov=camera.fovy, znear=camera.near, zfar=camera.far)
        self._scene.add(lens, pose=camera.pose)
        self._flags = pyrender.RenderFlags.FLAT
        self._offscreen = _open(pyrender, self._size)
        self._offscreen.render(self._scene, self._flags)  # uploads the buffers that are overwritten later

    def _pixels(self, vertices: Float32, normals: Float32) -> UInt8:
        from OpenGL import GL

        self._figure.pose(*self._smooth(vertices, normals))
        self._interleaved[:, :3] = self._figure.points
        self._interleaved[:, 3:6] = self._figure.colours
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._head._buffers[0])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, self._interleaved.nbytes, self._interleaved)
        pixels: UInt8 = self._offscreen.render(self._scene, self._flags)
        return pixels

    def close(self) -> None:
        """Free the context."""
        self._offscreen.delete()


def _pyrender() -> Any:
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")  # read once, when OpenGL is first imported
    try:
        import pyglet

        pyglet.options["headless"] = True  # otherwise pyrender's viewer looks for a display
        import pyrender
    except ModuleNotFoundError as error:
        raise RenderError(f"{NO_LIBRARY} (no module {error.name})") from None
    except (ImportError, AttributeError, OSError) as error:  # PyOpenGL's three ways to miss libEGL or libGL
        raise RenderError(f"{NO_GL} ({_first_line(error)})") from None
    return pyrender


def _open(pyrender: Any, size: tuple[int, int]) -> Any:
    """Return an offscreen renderer that reads colours only, on the first EGL device that works."""

    class Colours(pyrender.Renderer):  # type: ignore[misc]
        """A renderer that does not read the depth buffer, which takes half the time of a small picture."""

        def _read_main_framebuffer(self, scene: Any, flags: Any) -> UInt8:
            from OpenGL import GL

            width, height = self._main_fb_dims
            GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb_ms)
            GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._main_fb)
            box = (0, 0, width, height)
            GL.glBlitFramebuffer(*box, *box, GL.GL_COLOR_BUFFER_BIT, GL.GL_NEAREST)
            GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._main_fb)
            pixels = np.empty((height, width, 4), np.uint8)
            GL.glReadPixels(0, 0, width, height, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, pixels)
            return pixels[::-1]  # GL counts rows from the bottom

    class Offscreen(pyrender.OffscreenRenderer):  # type: ignore[misc]
        def _create(self) -> None:
            super()._create()
            self._renderer = Colours(self.viewport_width, self.viewport_height)

    chosen = os.environ.get("EGL_DEVICE_ID")
    fault: Exception | None = None
    for device in range(8) if chosen is None else (chosen,):
        os.environ["EGL_DEVICE_ID"] = str(device)  # the first card of a machine may be unusable
        try:
            return Offscreen(*size)
        except Exception as error:
            fault = fault or error
            if isinstance(error, ValueError):  # no device of that number: the first error is more useful
                break
    raise RenderError(f"{NO_GL} ({_first_line(fault)})")


def _first_line(error: BaseException | None) -> str:
    text = str(error).strip().splitlines()
    return text[0][:200] if text else type(error).__name__
