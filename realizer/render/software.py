"""The software backend, which draws on the processor."""

import numpy as np

from realizer.core.array_types import UInt8
from realizer.render.canvas import Canvas
from realizer.render.raster import Raster


class SoftwareCanvas(Canvas):
    """A head drawn by the processor: the same points, colours, camera and backdrop as by OpenGL."""

    def _open(self) -> None:
        self._raster = Raster(self._size)

    def _pixels(self) -> UInt8:
        figure = self._figure
        places, distances = self._camera.project(figure.points, self._size)
        # Parts of a head do not come near the lens; those of a broken one are not drawn.
        nearness = np.where(distances > self._camera.near, 1 / distances, np.nan).astype(np.float32)
        return self._raster(places, nearness, figure.triangles, figure.colours)

    def close(self) -> None:
        """End its threads."""
        self._raster.close()
