"""The software backend: what each sample of a picture sees, and the light from there, by the processor."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.colours import linear
from realizer.face.drawn_mesh import DrawnMesh
from realizer.render.canvas import Canvas
from realizer.render.lamp_view import SIDE, LampView
from realizer.render.light import Light, unit
from realizer.render.lighting import ROOM, ROWS, SETUP, SETUPS, light_band
from realizer.render.shading import tone_curve
from realizer.render.shadows import AWAY, depths_of, ends_around
from realizer.render.surfaces import mirrored_of, surfaces
from realizer.render.textures import ALPHA, Texels
from realizer.render.visibility import SAMPLES, fill, sort

MAX_THREADS = 4


class Raster:
    """Draws a mesh in pictures of one size; not thread-safe."""

    def __init__(
        self, size: tuple[int, int], mesh: DrawnMesh, colours: Float32, texels: Texels, lamp: LampView
    ) -> None:
        """Reserve the memory of a picture of (width, height) pixels.

        Args:
            colours: (d, 3) linear light, of the mesh's vertices.
            lamp: the view of the lamp that casts shadows.

        Raises:
            RenderError: numba is not installed; the text says what to install.
        """
        width, height = size
        self._picture = np.zeros((height, width, 4), np.uint8)
        self._texels = texels.values.view(np.uint32), texels.levels
        fixed = np.column_stack([mesh.uv, colours, mesh.occlusion, mesh.roughness]).astype(np.float32)
        rows = tuple(map(tuple, surfaces()))
        to_linear = linear(np.arange(256, dtype=np.uint8))
        self._mesh = mesh.triangles, fixed, mesh.kind, rows, to_linear, tone_curve()
        sides = mesh.two_sided.astype(np.uint8) | mesh.see_through.astype(np.uint8) << 1
        holes = np.ascontiguousarray(texels.values[:, ALPHA]), texels.levels
        # Each thread draws a band of rows; the loops release Python's lock.
        threads = max(1, min(MAX_THREADS, os.cpu_count() or 1, height))
        self._pool = ThreadPoolExecutor(threads)
        self._lamp = lamp
        self.front = View(size, 4 * threads, (mesh.triangles, sides, fixed, holes))
        self.cast = View((SIDE, SIDE), 2 * threads, (mesh.triangles, sides, fixed, holes))
        self._depths = np.empty(self.cast.keys.shape, np.float32)
        self._ends = np.empty((2, SIDE, SIDE, 2), np.float32)

    def __call__(self, points: Any, nearness: Float32, moving: Float32, lights: Any, eye: Float32) -> UInt8:
        """Return the picture (h, w, 4) uint8, premultiplied, from the top; it is valid until the next call.

        Args:
            points: (d, 2) pixels, x to the right and y down from the top left corner.
            nearness: (d,) 1 / distance, which is linear in the picture.
            moving: (d, 10) place and unit normal in metres, how much of the folds shows, and the direction
                of hairs.
            lights: as `shading.reflected` takes them, and the maps of the environment that is mirrored.
            eye: (3,) place of the camera in metres.
        """
        ordered = self._pool.submit(self.front.sort, points, nearness)
        shadows = *self._shadow_map(moving), self._lamp.matrix
        ordered.result()

        def band(rows: tuple[int, int]) -> None:
            self.front.fill(points, nearness, rows)
            pictures = self.front.keys, self._picture, _room(self._picture.shape[1])
            light_band(points, moving, self._mesh, self._texels, lights, (eye, shadows), rows, pictures)

        list(self._pool.map(band, self.front.bands))
        return self._picture

    def _shadow_map(self, moving: Float32) -> tuple[Float32, Float32]:
        """Return the depths that the lamp sees and their ends around, as `reach` takes them."""
        points = self._lamp.project(moving[:, :3])
        nearness = (AWAY - points[:, 2]).astype(np.float32)
        ends, around = self._ends
        self.cast.sort(points, nearness)

        def band(rows: tuple[int, int]) -> None:
            self.cast.fill(points, nearness, rows)
            depths_of(self.cast.keys, rows, self._depths, ends)

        list(self._pool.map(band, self.cast.bands))
        list(self._pool.map(lambda rows: ends_around(ends, rows, around), self.cast.bands))
        return self._depths, around

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()


class View:
    """What is seen from one place.

    Attributes:
        keys: (h, w, samples) uint64. The samples of a pixel are adjacent, so that a small triangle writes to
            adjacent memory. A sample is one number with nearness in the upper half and its triangle in the
            lower one, so that the greater number is the nearer sample.
        bands: first and last + 1 row of bands of about the same height.
    """

    def __init__(self, size: tuple[int, int], bands: int, mesh: Any) -> None:
        """Reserve memory; `mesh` is triangles, sides, fixed and holes, as `fill` takes them."""
        width, height = size
        self.keys = np.zeros((height, width, len(SAMPLES)), np.uint64)
        self._starts = np.arange(bands + 1) * height // bands
        self.bands = list(pairwise(self._starts.tolist()))
        self._mesh = mesh
        self._chosen, self._counts = np.empty((bands, len(mesh[0])), np.int32), np.empty(bands, np.int64)

    def sort(self, points: Any, nearness: Float32) -> None:
        """Choose the triangles of each band; arguments as of `Raster`."""
        triangles, sides, _, _ = self._mesh
        sort(points, nearness, triangles, sides, self._starts, self._chosen, self._counts)

    def fill(self, points: Any, nearness: Float32, rows: tuple[int, int]) -> None:
        """Write the nearest samples of a band."""
        band = self.bands.index(rows)
        chosen = self._chosen[band, : self._counts[band]]
        fill(points, nearness, chosen, self._mesh, rows, self.keys)


def _room(width: int) -> Any:
    """Return arrays for a thread to work in, as `light_band` takes them."""
    kinds, per = len(surfaces()), len(SAMPLES)
    whole = np.empty(per, np.int64), np.empty((SETUPS, 2), np.int64), np.empty(kinds, np.int64)
    near = np.empty(per, np.float32)
    points = np.empty((SETUPS, SETUP), np.float32), np.zeros((kinds, ROWS * ROOM), np.float32)
    sums = np.empty((kinds, ROOM), np.float32), np.empty((width, 4), np.float32)
    return (*whole, np.empty((kinds, ROOM), np.int64)), (near, *points, *sums)


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


def lights_of(light: Light) -> tuple[Any, Float32]:
    """Return a light as `shading.reflected` takes it, in numbers, and the environment that is mirrored."""
    exposure = np.float32(light.exposure)
    lamps: Float32 = np.array(
        [[unit(lamp.direction), np.multiply(lamp.colour, exposure)] for lamp in (light.key, light.rim)],
        np.float32,
    )
    around = tuple(map(tuple, light.environment.sh * exposure))
    glint = np.float32(light.glint), np.float32(light.glint_width)
    return (
        tuple(tuple(map(tuple, lamp)) for lamp in lamps),
        around,
        np.float32(light.rim_power),
        glint,
    ), mirrored_of(light)
