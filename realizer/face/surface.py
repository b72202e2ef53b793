"""Normals, and 16-bit quantised vertices for streams."""

from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int16
from realizer.face.model import Face

SHORT = 1e-3  # m; shorter sides of triangles count as that long in normals
ROOM = 0.15  # m around the neutral mesh for all that the head's turns and the jaw may reach


def normals(face: Face, vertices: Any) -> Float32:
    """Return unit normals of vertices (n, n_vertices, 3), float32; zero for a vertex without triangles.

    A triangle counts by its two sides at the vertex, as they are at rest: by its size, the diagonals chosen
    in long quads would show. Source: Max 1999, "Weights for computing vertex normals from facet normals".
    Cloth, whose small triangles at the hem are folded, counts by size.
    """
    vertices = np.asarray(vertices, np.float32)
    corners, (i, j, k) = _corners(face)
    out: Float32 = np.empty_like(vertices)
    for frame, ups in zip(vertices, out, strict=True):
        # Coordinate by coordinate: columns of their own are what numpy is quick with.
        at = np.ascontiguousarray(frame.T)
        first, second, third = (np.take(at, n, axis=1) for n in (i, j, k))
        second -= first
        third -= first
        (bx, by, bz), (cx, cy, cz) = second, third
        x, y, z = corners @ (by * cz - bz * cy), corners @ (bz * cx - bx * cz), corners @ (bx * cy - by * cx)
        length = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-20)
        for column, part in enumerate((x, y, z)):
            np.divide(part, length, out=ups[:, column])
    return out


def face_scale(face: Face) -> tuple[float, Float32]:
    """Return scale and offset (3,) of a streamed mesh: vertex = integer x scale + offset, metres."""
    low, high = face.bounds
    scale = float((high - low).max() + 2 * ROOM) / 65535
    return scale, ((low + high) / 2).astype(np.float32)


def quantise(face: Face, vertices: Any) -> Int16:
    """Return vertices (n, n_vertices, 3) in metres as int16 by `face_scale`; outliers are clipped."""
    scale, offset = face_scale(face)
    steps = (np.asarray(vertices, np.float32) - offset) * np.float32(1 / scale)
    np.rint(steps, out=steps)
    np.clip(steps, -32768, 32767, out=steps)
    whole: Int16 = steps.astype(np.int16)
    return whole


@lru_cache(maxsize=16)
def _corners(face: Face) -> tuple[Any, Any]:
    """Return the sparse weights (n_vertices, n_triangles), and the triangles' three columns."""
    from scipy.sparse import csr_matrix

    at = face.vertices[face.triangles]
    squares = np.maximum(((np.roll(at, -1, axis=1) - at) ** 2).sum(axis=2), SHORT**2)
    weights = 1 / (squares * np.roll(squares, 1, axis=1))
    first, last = face.parts.get("shirt", (0, 0))
    weights[(face.triangles >= first).all(axis=1) & (face.triangles < last).all(axis=1)] = 1
    columns = np.repeat(np.arange(len(at), dtype=np.int32), 3)
    matrix = csr_matrix((weights.ravel(), (face.triangles.ravel(), columns)), (len(face.vertices), len(at)))
    return matrix, tuple(np.ascontiguousarray(face.triangles.T))
