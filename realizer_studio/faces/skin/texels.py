"""The texels of a map that lie on a surface, and their positions."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, zoom
from scipy.spatial import cKDTree

from realizer.core.array_types import Bool, Float32, Float64, Index, Int32
from realizer.face.mesh_geometry import flat_cross, triangle_normals

PAD = 8  # texels around an island that repeat its edge
COARSE = 4  # texels between the samples of slowly varying fields


class Texels:
    """The texels inside the islands of a surface, in the order of rows.

    Attributes:
        size: texels of a side of the map.
        flat: (k,) index of each texel in the map.
        triangle: (k,) the triangle of each texel; weights: (k, 3) of the triangle's corners.
        at: (k, 3) metres, positions.
        width: (k,) metres, the width of a texel.
    """

    def __init__(self, vertices: Float64, triangles: Int32, corners: Float64, size: int) -> None:
        """
        Args:
            vertices: (n, 3) metres; triangles: (m, 3); corners: (m, 3, 2) texture coordinates, 0..1.
        """
        self.size, self._triangles = size, triangles
        self.flat, self.triangle, self.weights = _covered(corners * size - 0.5, size)
        self.at = self.spread(vertices)
        outside = np.ones((size, size), bool)
        outside.ravel()[self.flat] = False
        far, near = distance_transform_edt(outside, return_indices=True)
        self._pad: Index = np.flatnonzero((outside & (far <= PAD)).ravel())
        number = np.zeros(size * size, np.int32)
        number[self.flat] = np.arange(len(self.flat))
        self._source = number[np.ravel_multi_index(tuple(near.reshape(2, -1)[:, self._pad]), (size, size))]
        self.width = self.spread(_widths(vertices, triangles, corners * size))

    def spread(self, values: Any) -> Float32:
        """Interpolate values of the surface's vertices (n, ...) at the texels, (k, ...) float32."""
        values = np.asarray(values, np.float32)
        ends = self._triangles[self.triangle]
        shape = (-1,) + (1,) * (values.ndim - 1)
        out = values[ends[:, 0]] * self.weights[:, 0].reshape(shape)
        for k in (1, 2):
            out += values[ends[:, k]] * self.weights[:, k].reshape(shape)
        return np.asarray(out)

    def picture(self, values: Any, level: Any) -> Any:
        """Return values (k, ...) as a map (size, size, ...): padded around the islands, `level` elsewhere."""
        values = np.asarray(values)
        out = np.empty((self.size * self.size, *values.shape[1:]), values.dtype)
        out[:] = level
        out[self.flat] = values
        out[self._pad] = values[self._source]
        return out.reshape(self.size, self.size, *values.shape[1:])

    def blurred(self, values: Float32, radius: float) -> Float32:
        """Return values (k,) blurred by a radius in texels, each island separately."""
        cover = np.zeros((self.size, self.size), np.float32)
        image = cover.copy()
        image.ravel()[self.flat], cover.ravel()[self.flat] = values, 1
        image, cover = (gaussian_filter(part, radius, truncate=2.5) for part in (image, cover))
        return np.asarray(image.ravel()[self.flat] / cover.ravel()[self.flat])

    def broad(self, field: Callable[[Float32], Any]) -> Float32:
        """Return a slowly varying field (k,), computed at few positions (j, 3) and interpolated."""
        positions, cover = self._coarse
        inside = np.isfinite(positions[..., 0])
        coarse = np.zeros(positions.shape[:2], np.float32)
        coarse[inside] = field(positions[inside])
        return np.asarray(self._fine(coarse) / cover)

    @cached_property
    def _coarse(self) -> tuple[Float32, Float32]:
        """The sampled positions (j, j, 3), NaN outside islands, and the inner ones' weight at each texel."""
        positions = self.picture(self.at, np.nan)[COARSE // 2 :: COARSE, COARSE // 2 :: COARSE]
        return positions, np.maximum(self._fine(np.isfinite(positions[..., 0]).astype(np.float32)), 0.05)

    def _fine(self, coarse: Float32) -> Float32:
        image = zoom(coarse, COARSE, order=1, grid_mode=True, mode="nearest")
        return np.asarray(image.ravel()[self.flat], np.float32)

    def stamp(self, centres: Any, radius: Float32, shape: Callable[[Any], Any]) -> Float32:
        """Return the maximum of marks at each texel, (k,).

        Args:
            centres: (c,) texels, the centres of the marks.
            radius: (c,) metres.
            shape: profile of a mark: distance from its centre in radii -> value.
        """
        out = np.zeros(self.size * self.size, np.float32)
        positions = np.full((self.size * self.size, 3), np.nan, np.float32)
        positions[self.flat] = self.at
        reach = np.ceil(1.6 * radius / self.width[centres]).astype(int)
        for r in np.unique(reach):
            group = centres[reach == r]
            y, x = np.mgrid[-r : r + 1, -r : r + 1]
            step = (y * self.size + x).ravel()
            some = max(1, 400_000 // len(step))
            for first in range(0, len(group), some):
                part = slice(first, first + some)
                index = (self.flat[group[part], None] + step).clip(0, len(out) - 1)
                lengths = np.linalg.norm(positions[index] - self.at[group[part], None], axis=2)
                relative = lengths / radius[reach == r][part, None]
                value = np.where(relative < 1, shape(np.minimum(np.nan_to_num(relative, nan=1.0), 1)), 0)
                np.maximum.at(out, index.ravel(), value.ravel().astype(np.float32))
        return out[self.flat]

    def scatter(self, density: Float32, apart: float, rng: np.random.Generator) -> Any:
        """Return random texels (c,).

        Args:
            density: (k,) texels per square metre.
            apart: metres, the least distance between two of them.
        """
        candidates = np.flatnonzero(rng.random(len(density)) < density * self.width**2)
        candidates = rng.permutation(candidates)
        pairs = cKDTree(self.at[candidates]).query_pairs(apart, output_type="ndarray")
        removed: Bool = np.zeros(len(candidates), bool)
        removed[pairs.max(axis=1)] = True  # of two close ones, the later is removed
        return candidates[~removed]


def _covered(corners: Float64, size: int) -> tuple[Index, Int32, Float32]:
    """Return the texels with centres in triangles (m, 3, 2): index, triangle, weights of its corners."""
    flat, number, weights = [], [], []
    low = np.ceil(corners.min(axis=1)).clip(0, size - 1).astype(int)
    high = np.floor(corners.max(axis=1)).clip(0, size - 1).astype(int) + 1
    a, b, c = np.moveaxis(corners, 1, 0)
    p, q = b - a, c - a
    turn = flat_cross(p, q)
    for k in np.flatnonzero(np.abs(turn) > 1e-9):
        y, x = np.mgrid[low[k, 1] : high[k, 1], low[k, 0] : high[k, 0]]
        dx, dy = x - a[k, 0], y - a[k, 1]
        s = (dx * q[k, 1] - dy * q[k, 0]) / turn[k]
        t = (p[k, 0] * dy - p[k, 1] * dx) / turn[k]
        inside = (s >= 0) & (t >= 0) & (s + t <= 1)
        s, t = s[inside], t[inside]
        flat.append(y[inside] * size + x[inside])
        number.append(np.full(len(s), k))
        weights.append(np.stack([1 - s - t, s, t], 1))
    index, first = np.unique(np.concatenate(flat), return_index=True)
    return (
        index.astype(np.intp),
        np.concatenate(number)[first].astype(np.int32),
        np.concatenate(weights)[first].astype(np.float32),
    )


def _widths(vertices: Float64, triangles: Int32, corners: Float64) -> Float64:
    """Return the width of texels around each vertex in metres, (n,)."""
    area = np.linalg.norm(triangle_normals(vertices, triangles), axis=1)
    p, q = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    flat = np.abs(flat_cross(p, q))
    total, texels = np.zeros(len(vertices)), np.zeros(len(vertices))
    for k in range(3):
        np.add.at(total, triangles[:, k], area)
        np.add.at(texels, triangles[:, k], flat)
    return np.asarray(np.sqrt(total / np.maximum(texels, 1e-9)))
