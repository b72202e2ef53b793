"""The software backend, which draws on the processor."""

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.colours import linear
from realizer.render.canvas import Canvas
from realizer.render.light import Light, unit
from realizer.render.raster import Raster
from realizer.render.uniforms import mirrored_of


class SoftwareCanvas(Canvas):
    """A head drawn by the processor."""

    def _open(self) -> None:
        self._raster = Raster(self._size, self._mesh, linear(self._mesh.colours), self._texels, self._lamp)
        self._lights = lights_of(self._light)
        self._eye = self._camera.position.astype(np.float32)

    def _pixels(self) -> UInt8:
        points, distances = self._camera.project(self._moving[:, :3], self._size)
        # Parts of a head do not come near the lens; those of a broken one are not drawn.
        nearness = np.where(distances > self._camera.near, 1 / distances, np.nan).astype(np.float32)
        return self._raster(points, nearness, self._moving, self._lights, self._eye)

    def close(self) -> None:
        """End its threads."""
        self._raster.close()


def lights_of(light: Light) -> tuple[Float32, Float32, Float32, np.float32, Float32]:
    """Return a light as `shading.reflected` takes it: lamps, environment, rim lamp's power, glint."""
    lamps = [
        [unit(lamp.direction), np.multiply(lamp.colour, light.exposure)] for lamp in (light.key, light.rim)
    ]
    exposure = np.float32(light.exposure)
    return (
        np.array(lamps, np.float32), light.environment.sh * exposure, mirrored_of(light),
        np.float32(light.rim_power), np.array([light.glint, light.glint_width], np.float32),
    )  # fmt: skip
