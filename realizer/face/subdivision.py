"""One smooth subdivision of a face, which is drawn instead of the mesh that is deformed.

Source: Loop 1987, "Smooth subdivision surfaces based on triangles", with rims as in Hoppe et al. 1994.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64, Int32
from realizer.face.mesh_geometry import edges_of, half_edges, part_triangles
from realizer.face.model import Face

PARTS = ("skin", "tongue", "tears", "hair", "shirt")
MOST = 20_000  # triangles of a part that is coarse enough to be seen as such


@dataclass(frozen=True, eq=False)
class Subdivision:
    """A face whose coarse parts have four times as many triangles."""

    face: Face  # the face to draw; a part's new vertices, one an edge, follow those it had
    vertex: Int32  # (n,) the face's vertex of each vertex of the original face, which does not move
    middle: Int32  # (k,) the face's vertex on each of k edges
    smooth: Any  # sparse (k, n) float32; places of the vertices on edges = smooth @ original vertices
    mean: Any  # sparse (k, n) float32, the mean of the ends of each edge
    split: Bool  # (m,) which of the original triangles have become four; those come first, in four runs

    def corners(self, values: Float32) -> Float32:
        """Return values of the drawn triangles' corners (m', 3, k), for those of the original (m, 3, k)."""
        a, b, c = np.moveaxis(values[self.split], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        four = _four(a, b, c, ab, bc, ca)
        return np.concatenate([*(np.stack(corners, axis=1) for corners in four), values[~self.split]])

    def __call__(self, vertices: Float32, normals: Float32) -> tuple[Float32, Float32]:
        """Return vertices and normals (n + k, 3) to draw, for those of the original, (n, 3) each.

        Normals are means too: they turn over triangles as evenly as the surface does.
        """
        ups = self.mean @ normals
        ups /= np.maximum(np.sqrt(np.einsum("ij,ij->i", ups, ups)), 1e-20)[:, None]
        return self._joined(vertices, self.smooth @ vertices), self._joined(normals, ups)

    def _joined(self, own: Any, between: Any) -> Any:
        out = np.empty((len(own) + len(between), *own.shape[1:]), np.float32)
        out[self.vertex], out[self.middle] = own, between
        return out


@lru_cache(maxsize=16)
def subdivided(face: Face) -> Subdivision:
    """Return the face with its coarse parts subdivided once."""
    n = len(face.vertices)
    coarse_parts = {name: face.parts[name] for name in PARTS if _is_coarse(face, name)}
    end = np.zeros(n, np.int32)  # last + 1 vertex of the coarse part that a vertex belongs to, or 0
    for first, last in coarse_parts.values():
        end[first:last] = last
    ends = end[face.triangles]
    inside = (ends[:, 0] > 0) & (ends == ends[:, :1]).all(axis=1)
    coarse = face.triangles[inside]
    edges, counts = edges_of(coarse)
    order = np.argsort(np.concatenate([np.arange(n), end[edges[:, 0]] - 0.5]), kind="stable")
    place = np.argsort(order).astype(np.int32)
    added = {name: int((end[edges[:, 0]] == last).sum()) for name, (_, last) in coarse_parts.items()}
    parts = {
        name: (int(place[first]), int(place[last - 1]) + 1 + added.get(name, 0))
        for name, (first, last) in face.parts.items()
    }
    smooth, mean = _rules(n, coarse, edges, counts != 2)
    split = Subdivision(face, place[:n], place[n:], smooth, mean, inside)
    colours, occlusion, gloss = (
        split._joined(values, mean @ values)
        for values in (face.colours.astype(np.float32), face.occlusion, face.gloss)
    )
    drawn = replace(
        face,
        vertices=split._joined(face.vertices, smooth @ face.vertices),
        triangles=place[np.concatenate([_split(coarse, edges, n), face.triangles[~inside]])],
        colours=np.rint(colours).astype(np.uint8),
        occlusion=occlusion,
        gloss=gloss,
        parts=parts,
        feature_points={name: int(place[vertex]) for name, vertex in face.feature_points.items()},
        basis={},
    )
    return replace(split, face=drawn)


def _is_coarse(face: Face, name: str) -> bool:
    return name in face.parts and 0 < len(part_triangles(face.triangles, face.parts[name])) <= MOST


def _split(triangles: Int32, edges: Int32, n: int) -> Int32:
    """Return four triangles for each, over vertices and then the middles of edges (k, 2) from n on."""
    ab, bc, ca = n + _numbers(triangles, edges, n).reshape(3, -1)
    a, b, c = triangles.T
    return np.concatenate([np.stack(corners, axis=1) for corners in _four(a, b, c, ab, bc, ca)])


def _four(a: Any, b: Any, c: Any, ab: Any, bc: Any, ca: Any) -> tuple[tuple[Any, Any, Any], ...]:
    """Return the corners of the four triangles that a triangle is split into at the middles of its edges."""
    return (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)


def _numbers(triangles: Int32, edges: Int32, n: int) -> Int32:
    """Return the number (3 m,) of the edge at each side of triangles (m, 3), in the order of `half_edges`."""
    sides = np.sort(half_edges(triangles), axis=1)
    keys, sides = (pairs[:, 0].astype(np.int64) * n + pairs[:, 1] for pairs in (edges, sides))
    return np.asarray(np.searchsorted(keys, sides), np.int32)


def _rules(n: int, triangles: Int32, edges: Int32, rim: Bool) -> tuple[Any, Any]:
    """Return sparse matrices (k, n) for the middles of edges (k, 2): smooth places, and plain means.

    Loop's rules pull a surface inwards. So the mesh is pushed out by as much first, and what is left at the
    ends of an edge is added to its middle: vertices stay where they are.
    """
    import scipy.sparse as sp

    count = len(edges)

    def graph(pairs: Int32) -> Any:
        i, j = pairs.T
        return sp.csr_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), (n, n))

    near, along = graph(edges), graph(edges[rim])
    degree, ends = (np.asarray(each.sum(axis=1)).ravel() for each in (near, along))
    inner = (degree > 0) & (ends == 0)
    share = np.where(inner, np.where(degree == 3, 3 / 16, 3 / (8 * np.maximum(degree, 1))), 0.0)
    bent = np.where(ends == 2, 1 / 8, 0.0)
    vertex = (
        sp.diags_array(1 - share * degree - 2 * bent)
        + sp.diags_array(share) @ near
        + sp.diags_array(bent) @ along
    )
    number = np.arange(count)
    own = np.where(rim, 1 / 2, 3 / 8)
    middle = _matrix(np.r_[number, number], edges.T.ravel(), np.r_[own, own], (count, n))
    # The third corners of the two triangles at an inner edge.
    edge = _numbers(triangles, edges, n)
    third = triangles[:, [2, 0, 1]].T.ravel()
    keep = ~rim[edge]
    across = _matrix(edge[keep], third[keep], np.full(keep.sum(), 1 / 8), (count, n))
    half = _matrix(np.r_[number, number], edges.T.ravel(), np.full(2 * count, 1 / 2), (count, n))
    stays = sp.eye_array(n, format="csr")
    pushed = 2 * stays - vertex
    smooth = (middle + across) @ pushed + half @ (stays - vertex @ pushed)
    return smooth.tocsr().astype(np.float32), half.tocsr().astype(np.float32)


def _matrix(rows: Any, columns: Any, values: Float64, shape: tuple[int, int]) -> Any:
    import scipy.sparse as sp

    return sp.csr_matrix((values, (rows, columns)), shape)
