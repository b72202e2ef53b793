"""The software backend, which draws on the processor."""

from __future__ import annotations

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.face.model import Face
from realizer.render.backdrop import backdrop, channels, over
from realizer.render.cameras import Camera
from realizer.render.light import Light
from realizer.render.raster import Raster
from realizer.render.shaded_mesh import ShadedMesh


class SoftwareCanvas:
    """A head drawn by the processor: the same points, colours, camera and backdrop as by OpenGL."""

    def __init__(
        self,
        face: Face,
        size: tuple[int, int],
        camera: Camera,
        light: Light,
        background: str | None = None,
        *,
        smooth: bool = True,
    ) -> None:
        """Prepare; nothing is drawn.

        Args:
            background: as `backdrop` takes it.
            smooth: four samples a pixel instead of one.
        """
        self.size = size
        self._camera = camera
        self._figure = ShadedMesh(face, camera, light)
        self._backdrop = backdrop(size, light, background)
        self._channels = channels(background)
        self._raster = Raster(size, smooth=smooth)

    def draw(self, vertices: Float32, normals: Float32, out: UInt8 | None = None) -> UInt8:
        """Return (h, w, 3 or 4) uint8, row 0 at the top, of (n, 3) vertices and normals; into `out` if given.

        Raises:
            RenderError: no numba.
        """
        figure = self._figure
        figure.pose(vertices, normals)
        places, distances = self._camera.see(figure.points, self.size)
        # Parts of a head do not come near the lens; those of a broken one are not drawn.
        nearness = np.where(distances > self._camera.near, 1 / distances, np.nan).astype(np.float32)
        pixels = self._raster(places, nearness, figure.triangles, figure.colours)
        if out is None:
            out = np.empty((*pixels.shape[:2], self._channels), np.uint8)
        if self._channels == 3:
            return self._raster.over(self._backdrop, out)
        return over(pixels, self._backdrop, out)

    def close(self) -> None:
        """End its threads."""
        self._raster.close()
