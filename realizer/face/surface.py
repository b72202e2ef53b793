"""Vertices in, what clients need beside them out: normals, and 16-bit integers for streams."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from realizer.arrays import Float32, Int16
from realizer.face.model import Face

__all__ = ["face_scale", "normals", "quantise"]

ROOM = 0.15  # m around the neutral mesh for all that the head's turns and the jaw may reach


def normals(face: Face, vertices: Any) -> Float32:
    """Unit normals of (n, n_vertices, 3) vertices, same shape, float32; zero where a vertex has no triangle."""
    vertices = np.asarray(vertices, np.float32)
    a, b, c = (vertices[:, face.triangles[:, k]] for k in range(3))
    b -= a
    c -= a
    faces = np.empty((len(face.triangles), len(vertices), 3), np.float32)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        faces[:, :, k] = (b[..., i] * c[..., j] - b[..., j] * c[..., i]).T
    summed = _corners(face) @ faces.reshape(len(face.triangles), -1)
    out = np.ascontiguousarray(summed.reshape(-1, len(vertices), 3).transpose(1, 0, 2))
    out /= np.maximum(np.sqrt(np.einsum("nij,nij->ni", out, out)), 1e-20)[..., None]
    return out


def face_scale(face: Face) -> tuple[float, Float32]:
    """Scale and offset (3,) of a streamed mesh: vertex = integer x scale + offset, metres."""
    low, high = face.bounds
    scale = float((high - low).max() + 2 * ROOM) / 65535
    return scale, ((low + high) / 2).astype(np.float32)


def quantise(face: Face, vertices: Any) -> Int16:
    """Vertices (n, n_vertices, 3) metres as int16 by `face_scale`; what lies outside is clipped."""
    scale, offset = face_scale(face)
    steps = (np.asarray(vertices, np.float32) - offset) * np.float32(1 / scale)
    return np.clip(np.rint(steps), -32768, 32767).astype(np.int16)


@lru_cache(maxsize=16)
def _corners(face: Face) -> Any:
    """(n_vertices, n_triangles) sparse, 1 where the triangle has the vertex."""
    from scipy.sparse import csr_matrix

    m = len(face.triangles)
    ones = np.ones(3 * m, np.float32)
    columns = np.repeat(np.arange(m), 3)
    return csr_matrix((ones, (face.triangles.ravel(), columns)), (len(face.vertices), m))
