"""A face, a size, a camera, then vertices and normals in; pixels out. The only importer of pyrender."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from realizer.arrays import Float32, Int32, UInt8
from realizer.errors import RenderError
from realizer.face.model import Face
from realizer.render.cameras import Camera
from realizer.render.glints import Glints
from realizer.render.light import Light, Shader

__all__ = ["Canvas"]

NO_LIBRARY = "pictures need the render extra: pip install 'bml-realizer[render]'"
NO_GL = "pictures need OpenGL: install Debian packages libegl1 and libgl1"


class Canvas:
    """A head on the graphics card (or its stand-in in software), drawn again and again.

    Belongs to the thread that made it, as its GL context does; one at a time in a process. Light is worked
    out a vertex, in numpy, and drawn flat: four times as fast as a lit shader on a software GL.
    """

    def __init__(self, face: Face, size: tuple[int, int], camera: Camera, light: Light) -> None:
        """Opens a GL context.

        Raises:
            RenderError: no pyrender or no GL; the text says what to install.
        """
        pyrender = _pyrender()
        self.size = size
        self._glints = Glints(face, light, camera.towards)
        self._shader = Shader(light, face.colours, face.occlusion, face.gloss, camera.towards)
        self._backdrop = backdrop(size, light)
        self._count = len(face.vertices)
        vertices = np.concatenate([face.vertices, self._glints(face.vertices)])
        # x y z r g b a, as pyrender lays a primitive of positions and colours out in its one buffer.
        self._interleaved = np.ones((len(vertices), 7), np.float32)
        triangles = np.concatenate([_visible_triangles(face), self._glints.triangles + self._count])
        material = pyrender.MetallicRoughnessMaterial(baseColorFactor=[1.0, 1.0, 1.0, 1.0])
        # Colours must be floats: pyrender takes integers 0/1 for 0..255 and draws black.
        colours = np.ones((len(vertices), 4), np.float32)
        self._head = pyrender.Primitive(vertices, color_0=colours, indices=triangles, material=material)
        self._scene = pyrender.Scene(bg_color=[0.0, 0.0, 0.0, 0.0])
        self._scene.add(pyrender.Mesh([self._head]))
        lens = pyrender.PerspectiveCamera(yfov=camera.fovy, znear=camera.near, zfar=camera.far)
        self._scene.add(lens, pose=camera.pose)
        self._flags = pyrender.RenderFlags.FLAT
        self._offscreen = _open(pyrender, size)
        self._offscreen.render(self._scene, self._flags)  # uploads the buffers that `draw` overwrites

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """(h, w, 3) uint8, row 0 at the top, of (n, 3) vertices and unit normals; into `out` if given."""
        from OpenGL import GL

        self._interleaved[: self._count, :3] = vertices
        self._interleaved[: self._count, 3:6] = self._shader(normals)
        self._interleaved[self._count :, :3] = self._glints(vertices)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._head._buffers[0])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, self._interleaved.nbytes, self._interleaved)
        pixels: UInt8 = self._offscreen.render(self._scene, self._flags)
        if out is None:
            out = np.empty((*pixels.shape[:2], 3), np.uint8)
        return over(pixels, self._backdrop, out)

    def close(self) -> None:
        """Free the context."""
        self._offscreen.delete()


def backdrop(size: tuple[int, int], light: Light) -> UInt8:
    """(h, w, 4) uint8, opaque: a soft gradient, lighter in the middle, so that the head stands off."""
    width, height = size
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    out = np.clip(np.hypot(x, y * 0.9 + 0.1) / 1.35, 0, 1)[..., None]
    mix = out * out * (3 - 2 * out)
    colours = np.asarray(light.backdrop_middle) * (1 - mix) + np.asarray(light.backdrop_edge) * mix
    # Half a step of ordered noise hides the bands that 8 bits would make of so slow a gradient.
    noise = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16 - 0.47
    tiles = np.tile(noise, (-(-height // 4), -(-width // 4)))[:height, :width, None]
    rgba = np.full((height, width, 4), 255, np.uint8)
    rgba[..., :3] = np.rint(colours * 255 + tiles).clip(0, 255)
    return rgba


def over(pixels: UInt8, behind: UInt8, out: UInt8) -> UInt8:
    """(h, w, 4) premultiplied pixels over (h, w, 4) opaque ones, as (h, w, 3).

    1.0 ms at 512x512, where drawing the backdrop with MSAA took 11.
    """
    # A pixel at a time as one integer, then a channel at a time: numpy is slow along an axis of three.
    height, width = pixels.shape[:2]
    cover = pixels[..., 3]
    whole = np.where(cover == 255, pixels.view(np.uint32)[..., 0], behind.view(np.uint32)[..., 0])
    merged = whole.view(np.uint8).reshape(height, width, 4)
    for channel in range(3):
        out[..., channel] = merged[..., channel]
    outline = np.flatnonzero(cover - np.uint8(1) < np.uint8(254))  # neither 0, which wraps round, nor 255
    y, x = np.divmod(outline, width)
    rest = 255 - cover[y, x].astype(np.uint16)[:, None]
    shows = (behind[y, x, :3] * rest + 127) // 255
    out[y, x] = np.minimum(pixels[y, x, :3] + shows, 255)
    return out


# Parts with an inside that is never seen; all others (hair, clothes, lashes) may be sheets.
SOLID = ("skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue")


def _visible_triangles(face: Face) -> Int32:
    """The triangles, those of sheets both ways round: culling what faces away saves a quarter."""
    solid = np.zeros(len(face.vertices), bool)
    for name in SOLID:
        solid[slice(*face.parts.get(name, (0, 0)))] = True
    sheets = face.triangles[~solid[face.triangles].all(axis=1)]
    return np.concatenate([face.triangles, sheets[:, ::-1]])


def _pyrender() -> Any:
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")  # read once, when OpenGL is first imported
    try:
        import pyglet

        pyglet.options["headless"] = True  # or pyrender's viewer looks for a display
        import pyrender
    except ModuleNotFoundError as error:
        raise RenderError(f"{NO_LIBRARY} (no module {error.name})") from None
    except (ImportError, AttributeError, OSError) as error:  # PyOpenGL's three ways to miss libEGL or libGL
        raise RenderError(f"{NO_GL} ({_first_line(error)})") from None
    return pyrender


def _open(pyrender: Any, size: tuple[int, int]) -> Any:
    """An offscreen renderer that reads colours only; on the first EGL device that works."""

    class Colours(pyrender.Renderer):  # type: ignore[misc]
        """Leaves out the depth read-back, half the cost of a small picture."""

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
        os.environ["EGL_DEVICE_ID"] = str(device)  # a machine may list a card that we may not use first
        try:
            return Offscreen(*size)
        except Exception as error:
            fault = fault or error
            if isinstance(error, ValueError):  # no device of that number: the first fault tells more
                break
    raise RenderError(f"{NO_GL} ({_first_line(fault)})")


def _first_line(error: BaseException | None) -> str:
    text = str(error).strip().splitlines()
    return text[0][:200] if text else type(error).__name__
