"""Texture coordinates of the skin: the islands of the base mesh, packed so that the face gets most texels."""

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64, Int32
from realizer_studio.faces.parts import Submesh
from realizer_studio.faces.person.makehuman import BaseMesh

SIZE = 2048  # texels of a side of the maps


class Square(NamedTuple):
    """A region of the maps, in shares of their sides from the top left."""

    left: float
    top: float
    right: float
    bottom: float

    def texels(self, size: int = SIZE) -> tuple[slice, slice]:
        """Return the rows and columns of the region in a map of that size."""
        left, top, right, bottom = (round(share * size) for share in self)
        return slice(top, bottom), slice(left, right)


# The texels of triangles without a texture; the regions of the hair's and the eyes' textures.
NEUTRAL = Square(0, 0, 1 / 128, 1 / 128)
HAIR = Square(0.875, 0.875, 1, 1)
EYES = Square(0.75, 0.875, 0.875, 1)

# Islands of the base mesh, in the order of its texture coordinates, and their regions.
HEAD, MOUTH, BODY, RIGHT_SOCKET, LEFT_SOCKET = 0, 1, 2, 3, 6
SQUARES = {
    MOUTH: Square(0.655, 0.655, 0.86, 0.80),
    BODY: Square(0.006, 0.655, 0.64, 0.994),
    RIGHT_SOCKET: Square(0.875, 0.655, 0.985, 0.75),
    LEFT_SOCKET: Square(0.875, 0.765, 0.985, 0.86),
}
# The island of the head is rotated. Down the map goes texture coordinate u, from the top of the scalp to
# below the chin; across goes v, from the middle line. The face is enlarged, the scalp is not.
DOWN = np.array([0.641, 0.74, 0.765, 0.93, 0.994]), np.array([0.006, 0.096, 0.130, 0.508, 0.640])
MIDDLE = 0.4835
ACROSS = np.array([0, 0.035, 0.11, 0.16, 0.335]), np.array([0, 0.108, 0.277, 0.360, 0.494])
MOST = 2.2  # largest enlargement of an island


def corners(mesh: BaseMesh, patch: Submesh) -> Float64:
    """Return the texture coordinates (m, 3, 2) of the corners of a surface's triangles.

    A corner outside the island of its triangle gets the coordinates of the nearest vertex of that island.
    """
    charts, islands = _charts(mesh)
    rest = patch.mix @ mesh.vertices
    each = np.stack([patch.mix @ chart for chart in charts])  # (charts, n, 2), NaN where a vertex is not
    for island in np.unique(islands):
        on_island = islands == island
        each[on_island] = _island_uv(int(island), each[on_island])
    mapped = np.isfinite(each[..., 0])
    best = mapped[:, patch.triangles].sum(axis=2).argmax(axis=0)
    for chart in np.unique(best):
        used = np.unique(patch.triangles[best == chart])
        unmapped = used[~mapped[chart, used]]
        if len(unmapped):
            candidates = np.flatnonzero(mapped[chart])
            each[chart, unmapped] = each[
                chart, candidates[cKDTree(rest[candidates]).query(rest[unmapped])[1]]
            ]
    return np.asarray(each[best[:, None], patch.triangles])


def _charts(mesh: BaseMesh) -> tuple[Float64, Int32]:
    """Return the texture coordinates (k, n, 2) of base vertices in each chart, NaN elsewhere, and its island.

    There are three charts for each island: the island without the vertices of its seam along the middle line,
    which have several coordinates, and both of its sides with them.
    """
    quads, corner = mesh.quads["body"], mesh.corners
    ends = np.concatenate([corner[:, [k, (k + 1) % 4]] for k in range(4)]).T
    count = len(mesh.texture)
    links = sp.coo_matrix((np.ones(ends.shape[1]), tuple(ends)), (count, count))
    island = connected_components(links, directed=False)[1][corner[:, 0]]
    left = mesh.vertices[quads, 0].mean(axis=1) > 0
    numbers = np.intersect1d(island, [HEAD, *SQUARES])
    charts = np.full((3, len(numbers), len(mesh.vertices), 2), np.nan)
    for merged, *sides, number in zip(*charts, numbers, strict=True):
        for chart, half in zip(sides, (left, ~left), strict=True):
            selected = half & (island == number)
            chart[quads[selected].ravel()] = mesh.texture[corner[selected].ravel()]
        one, other = sides
        merged[:] = np.where(np.isnan(one), other, one)
        merged[(np.abs(one - other) > 1e-6).any(axis=1)] = np.nan
    return charts.reshape(-1, *charts.shape[2:]), np.tile(numbers, 3)


def _island_uv(island: int, texture: Float64) -> Float64:
    """Return coordinates in the maps for an island's texture coordinates (..., 2)."""
    u, v = np.moveaxis(texture, -1, 0)
    if island == HEAD:
        offset = v - MIDDLE
        return np.stack([0.5 + np.sign(offset) * np.interp(np.abs(offset), *ACROSS), np.interp(u, *DOWN)], -1)
    square = SQUARES[island]
    low, high = (np.array([f(u), f(1 - v)]) for f in (np.nanmin, np.nanmax))
    room = np.array([square.right - square.left, square.bottom - square.top])
    scale = min(*(room / np.maximum(high - low, 1e-9)), MOST)
    return np.asarray((np.stack([u, 1 - v], -1) - low) * scale + square[:2])


def packed(uv: Any) -> Any:
    """Return coordinates in the maps, 0..1, as uint16."""
    return np.clip(np.rint(np.asarray(uv) * 65535), 0, 65535).astype(np.uint16)
