"""The OpenGL backend; the only importer of moderngl."""

import math
import os
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.colours import linear
from realizer.core.errors import RenderError
from realizer.face.drawn_mesh import DrawnMesh
from realizer.render.cameras import Camera
from realizer.render.canvas import Canvas
from realizer.render.lamp_view import SIDE
from realizer.render.surfaces import mirrored_of, uniforms_of
from realizer.render.textures import TEXTURES, Texels

NO_LIBRARY = "pictures by OpenGL need the render extra: pip install 'bml-realizer[render]'"
NO_GL = "pictures by OpenGL need OpenGL 4.0: install Debian packages libegl1 and libgl1"
DEVICE = "GLCONTEXT_DEVICE_INDEX"  # the variable of moderngl that selects the EGL device
DEVICES = 8  # tried at most
EGL: Any = {"backend": "egl", "libegl": "libEGL.so.1", "libgl": "libGL.so.1"}
SAMPLES = 4  # of a pixel
DEPTH_CLAMP = 0x864F  # a constant of OpenGL: what lies outside the lamp's box casts shadows too
MOVING, FIXED = ("place", "normal", "fold", "strand"), ("uv", "colour", "occlusionRough", "kind")

VERTEX = """#version 400 core
uniform mat4 world;
in vec3 place, normal, strand; in float fold, kind; in vec2 uv, occlusionRough; in vec3 colour;
out vec3 at, up, hair, tint; out vec2 map, hidden; out float folded; flat out int sort;
void main() {
  gl_Position = world * vec4(place, 1.0);
  at = place; up = normal; hair = strand; tint = colour; map = uv;
  hidden = occlusionRough; folded = fold; sort = int(kind);
}
"""
HEAD = """#version 400 core
in vec3 at, up, hair, tint; in vec2 map, hidden; in float folded; flat in int sort;
"""
# The samples of a pixel that a card covers: those whose threshold its alpha exceeds; layers of hair differ.
COVER = """
uniform int first;
int coveredBy(float alpha) {
  int shift = int(uint(first + gl_PrimitiveID >> 4) * 2654435761u >> 7 & 3u), covered = 0;
  for (int k = 0; k < 4; k++)
    if (alpha * 255.0 > float(((k + shift & 3) << 6) + 31)) covered |= 1 << k;
  if (covered == 0) discard;
  return covered;
}
"""
DRAW = """
uniform vec3 eye;
out vec4 pixel;
void main() {
  pixel = vec4(surfaceColour(sort, at, up, hair, map, tint, hidden, folded, gl_FrontFacing, eye), 1.0);
}
"""
DRAW_HOLES = COVER + DRAW.replace("main() {", "main() {\n  gl_SampleMask[0] = coveredBy(coverOf(map, 0.0));")
CAST = "void main() {}"
CAST_HOLES = (
    COVER
    + """
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy) & 1;
  if ((coveredBy(coverOf(map, 1.0)) >> (p.x + 2 * p.y) & 1) == 0) discard;
}
"""
)


class OpenGLCanvas(Canvas):
    """A canvas that draws with OpenGL.

    It belongs to the thread that made it, as its GL context does.
    """

    def _open(self) -> None:
        self._context = _context()
        with self._context as gl:
            self._moved = gl.buffer(self._moving.tobytes(), dynamic=True)
            self._fixed = gl.buffer(_fixed(self._mesh).tobytes())
            self._shadows = gl.depth_texture((2 * SIDE, 2 * SIDE))
            self._shadows.compare_func, self._shadows.filter = "", (gl.NEAREST, gl.NEAREST)
            self._textures = {
                **_maps(gl, self._texels),
                "mirrorMap": _mirror(gl, mirrored_of(self._light)),
                "shadowMap": self._shadows,
            }
            self._lamp_side = gl.framebuffer(depth_attachment=self._shadows)
            self._samples = gl.framebuffer(
                gl.renderbuffer(self._size, samples=SAMPLES),
                gl.depth_renderbuffer(self._size, samples=SAMPLES),
            )
            self._picture = gl.framebuffer(gl.renderbuffer(self._size))
            surface = files("realizer.render").joinpath("surface.glsl").read_text()
            self._casting = self._pass(gl, _lamp_matrix(self._lamp.matrix), CAST, surface + CAST_HOLES)
            view = _view_matrix(self._camera, self._size)
            self._drawing = self._pass(gl, view, surface + DRAW, surface + DRAW_HOLES)

    def _pass(self, gl: Any, world: Float32, solid: str, holes: str) -> list[tuple[bool, int, Any]]:
        """Return for each sort of triangles: if they are seen from both sides, the first, and their array."""
        values = {**uniforms_of(self._light, self._lamp), "world": world.T, "eye": self._camera.position}
        mesh, arrays = self._mesh, []
        for code, see_through in ((solid, False), (holes, True)):
            if see_through not in mesh.see_through:
                continue
            program = gl.program(vertex_shader=VERTEX, fragment_shader=HEAD + code)
            _give(program, values, tuple(self._textures))
            for two_sided in (False, True):
                which = np.flatnonzero((mesh.see_through == see_through) & (mesh.two_sided == two_sided))
                if len(which):
                    arrays.append((two_sided, int(which[0]), self._array(gl, program, which)))
        return arrays

    def _array(self, gl: Any, program: Any, which: Any) -> Any:
        buffers = [(self._moved, MOVING, "3f 3f 1f 3f"), (self._fixed, FIXED, "2f 3f 2f 1f")]
        index = gl.buffer(self._mesh.triangles[which].tobytes())
        return gl.vertex_array(
            program, [(buffer, form, *names) for buffer, names, form in buffers], index, skip_errors=True
        )

    def _pixels(self) -> UInt8:
        with self._context as gl:
            self._moved.write(self._moving)
            for place, texture in enumerate(self._textures.values()):
                texture.use(place)
            gl.enable(gl.DEPTH_TEST)
            # Rows are drawn from the top, so triangles turn the other way round.
            gl.front_face, gl.cull_face = "cw", "back"
            for target, arrays in ((self._lamp_side, self._casting), (self._samples, self._drawing)):
                target.use()
                target.clear()
                for two_sided, first, array in arrays:
                    (gl.disable if two_sided else gl.enable)(gl.CULL_FACE)
                    if "first" in array.program:
                        array.program["first"].value = first
                    array.render()
            gl.copy_framebuffer(self._picture, self._samples)
            width, height = self._size
            pixels = np.empty((height, width, 4), np.uint8)
            self._picture.read_into(pixels, components=4)
            return pixels

    def close(self) -> None:
        """Free the context."""
        self._context.release()


def _fixed(mesh: DrawnMesh) -> Float32:
    """Return the values of vertices that do not change, (d, 8)."""
    columns = mesh.uv, linear(mesh.colours), mesh.occlusion, mesh.roughness, mesh.kind
    return np.column_stack(columns).astype(np.float32)


def _maps(gl: Any, texels: Texels) -> dict[str, Any]:
    textures = {}
    for name, channels in TEXTURES.items():
        first = texels.level(0)[..., channels]
        texture = gl.texture(first.shape[1::-1], len(channels), first.tobytes())
        texture.build_mipmaps()
        for k in range(1, len(texels.levels)):
            texture.write(texels.level(k)[..., channels].tobytes(), level=k)
        texture.filter = gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR
        texture.repeat_x = texture.repeat_y = False
        textures[name] = texture
    return textures


def _mirror(gl: Any, levels: Float32) -> Any:
    count, height, width = levels.shape[:3]
    texture = gl.texture_array((width, height, count), 3, levels.astype(np.float16).tobytes(), dtype="f2")
    texture.repeat_x = texture.repeat_y = False
    return texture


def _give(program: Any, values: Mapping[str, Any], textures: Sequence[str]) -> None:
    for name in program:
        if name in textures:
            program[name].value = textures.index(name)
        elif name in values:
            kind = np.int32 if isinstance(values[name], int) else np.float32
            program[name].write(np.asarray(values[name], kind).tobytes())


def _view_matrix(camera: Camera, size: tuple[int, int]) -> Float32:
    """Return the matrix (4, 4) from metres to the picture, with +y down."""
    width, height = size
    zoom, near, far = 1 / math.tan(camera.fovy / 2), camera.near, camera.far
    lens = np.zeros((4, 4))
    lens[0, 0], lens[1, 1], lens[3, 2] = zoom * height / width, -zoom, -1
    lens[2, 2:] = (far + near) / (near - far), 2 * far * near / (near - far)
    return np.asarray(lens @ np.linalg.inv(camera.pose), np.float32)


def _lamp_matrix(lamp: Float32) -> Float32:
    """Return the matrix (4, 4) from metres to the shadow map, for that of a `LampView`."""
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3] = 2 * lamp / np.array([[SIDE], [SIDE], [1]])
    matrix[:3, 3] -= 1
    return matrix


def _context() -> Any:
    """Return a context on the first EGL device that works.

    Raises:
        RenderError: moderngl or OpenGL is missing; the text says what to install.
    """
    try:
        import moderngl
    except ImportError as error:
        raise RenderError(f"{NO_LIBRARY} ({error})") from None
    fault: Exception | None = None
    for device in range(
        1 if DEVICE in os.environ else DEVICES
    ):  # the first card of a machine may be unusable
        try:
            context = moderngl.create_context(400, True, **{**EGL, "device_index": device})
        except Exception as error:
            fault = fault or error
            continue
        context.enable_direct(DEPTH_CLAMP)
        return context
    raise RenderError(f"{NO_GL} ({_first_line(fault)})")


def _first_line(error: BaseException | None) -> str:
    text = str(error).strip().splitlines()
    return text[0][:200] if text else type(error).__name__
