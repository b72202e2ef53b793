"""A head that is drawn again and again: what all backends share."""

from abc import ABC, abstractmethod

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.model import Face
from realizer.render.backdrop import backdrop, channels, over
from realizer.render.cameras import Camera
from realizer.render.folds import Folds
from realizer.render.lamp_view import LampView
from realizer.render.light import Light
from realizer.render.textures import texels_of


class Canvas(ABC):
    """A head that a backend draws again and again."""

    def __init__(
        self, face: Face, size: tuple[int, int], camera: Camera, light: Light, background: str | None = None
    ) -> None:
        """Prepare; `background` as `realizer.render.backdrop.backdrop` takes it.

        Raises:
            RenderError: the backend is missing here; the text says what to install.
        """
        self._size, self._camera, self._light = size, camera, light
        self._mesh, self._folds = drawn_mesh(face), Folds(face)
        self._texels = texels_of(face.maps, 2 * max(size))
        self._lamp = LampView(light.key.direction, *face.bounds)
        # Place, unit normal, share of the folds and direction of hairs of each drawn vertex.
        self._moving = np.zeros((len(self._mesh.uv), 10), np.float32)
        self._backdrop, self._channels = backdrop(size, light, background), channels(background)
        self._open()

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """Return (h, w, 3) uint8, (h, w, 4) where transparent, row 0 at the top; in `out` if that is given.

        Args:
            vertices, normals: (n, 3) metres and unit vectors of the face.
        """
        if out is None:
            out = np.empty((*self._size[::-1], self._channels), np.uint8)
        self._moving[:, :3], self._moving[:, 3:7] = self._mesh(vertices, normals, self._folds(vertices))
        self._moving[:, 7:] = self._mesh.strands @ vertices
        return over(self._pixels(), self._backdrop, out)

    @abstractmethod
    def close(self) -> None:
        """Release the canvas's resources."""

    @abstractmethod
    def _open(self) -> None:
        """Prepare to draw."""

    @abstractmethod
    def _pixels(self) -> UInt8:
        """Return the head as (h, w, 4) premultiplied, with `_moving` as it is now."""
