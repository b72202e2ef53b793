"""The shaded mesh of a frame, and the canvas that draws it."""

from abc import ABC, abstractmethod

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.face.model import Face
from realizer.render.backdrop import backdrop, channels, over
from realizer.render.cameras import Camera
from realizer.render.eye_highlights import EyeHighlights
from realizer.render.light import Light, Shader
from realizer.render.wrinkles import Wrinkles


class ShadedMesh:
    """The head and the renderer's additions, lit: all backends draw the same triangles.

    Attributes:
        triangles: (m, 3) int32, counter-clockwise as seen; sheets are there both ways round.
        points: (n, 3) float32 metres.
        colours: (n, 3) float32 sRGB 0..1.
    """

    def __init__(self, face: Face, camera: Camera, light: Light) -> None:
        self._glints = EyeHighlights(face, light, camera.towards)
        self._wrinkles = Wrinkles(face)
        self._shader = Shader(light, face.colours, face.occlusion, face.gloss, camera.towards)
        count = len(face.vertices)
        self._head = slice(0, count)
        self._furrows = slice(count, count + self._wrinkles.count)
        self._caps = slice(self._furrows.stop, None)
        glints = self._glints(face.vertices)
        furrows = np.zeros((self._wrinkles.count, 3), np.float32)
        self.points: Float32 = np.concatenate([face.vertices, furrows, glints])
        self.colours: Float32 = np.ones_like(self.points)
        self.triangles: Int32 = np.concatenate(
            [
                _visible_triangles(face),
                self._wrinkles.triangles + self._furrows.start,
                self._glints.triangles + self._caps.start,
            ]
        ).astype(np.int32)

    def pose(self, vertices: Float32, normals: Float32) -> None:
        """Move `points` and `colours` to the head's (n_vertices, 3) vertices and unit normals."""
        colours = self._shader(normals)
        self.points[self._head], self.colours[self._head] = vertices, colours
        self.points[self._furrows], self.colours[self._furrows] = self._wrinkles(vertices, normals, colours)
        self.points[self._caps] = self._glints(vertices)


# Parts with an inside that is never seen; all others (hair, clothes, lashes) may be sheets.
SOLID = ("skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue")


def _visible_triangles(face: Face) -> Int32:
    """Return the triangles, those of sheets both ways round: culling back faces saves a quarter."""
    solid = np.zeros(len(face.vertices), bool)
    for name in face.parts.keys() & set(SOLID):
        solid[slice(*face.parts[name])] = True
    sheets = face.triangles[~solid[face.triangles].all(axis=1)]
    return np.concatenate([face.triangles, sheets[:, ::-1]])


class Canvas(ABC):
    """A head that a backend draws again and again."""

    def __init__(
        self, face: Face, size: tuple[int, int], camera: Camera, light: Light, background: str | None = None
    ) -> None:
        """Prepare; `background` as `realizer.render.backdrop.backdrop` takes it.

        Raises:
            RenderError: the backend is missing here; the text says what to install.
        """
        self._face, self._size, self._camera, self._light = face, size, camera, light
        self._backdrop, self._channels = backdrop(size, light, background), channels(background)
        self._open()

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """Return (h, w, 3) uint8, (h, w, 4) where transparent, row 0 at the top; in `out` if that is given.

        Args:
            vertices, normals: (n, 3) metres and unit vectors of the face.
        """
        if out is None:
            out = np.empty((*self._size[::-1], self._channels), np.uint8)
        return over(self._pixels(vertices, normals), self._backdrop, out)

    @abstractmethod
    def close(self) -> None:
        """Release the canvas's resources."""

    @abstractmethod
    def _open(self) -> None:
        """Prepare to draw."""

    @abstractmethod
    def _pixels(self, vertices: Float32, normals: Float32) -> UInt8:
        """Return the head as (h, w, 4) premultiplied."""
