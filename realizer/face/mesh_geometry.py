"""Edges, neighbours, normals, mirror images and balls of triangle meshes."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32

FINE = 1e3  # units a metre for which trimesh's tolerances are meant: millimetres


def grid(rows: int, columns: int, closed: bool = False) -> Int32:
    """Return the triangles of a sheet of rows x columns vertices; `closed` joins last column and first."""
    last = columns if closed else columns - 1
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(last), indexing="ij")
    a = (r * columns + c).ravel()
    b = (r * columns + (c + 1) % columns).ravel()
    return np.concatenate(
        [np.stack([a, a + columns, b], 1), np.stack([b, a + columns, b + columns], 1)]
    ).astype(np.int32)


def part_triangles(triangles: Int32, part: tuple[int, int]) -> Int32:
    """Return the triangles (k, 3) of a part (first, last + 1), with vertices counted from its first."""
    first, last = part
    return np.asarray(triangles[((triangles >= first) & (triangles < last)).all(axis=1)] - first)


def half_edges(triangles: Int32) -> Int32:
    """Return the sides of triangles (m, 3) in their direction, (3 m, 2)."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def edges_of(triangles: Int32) -> tuple[Int32, Any]:
    """Return the edges (k, 2) of triangles (m, 3), each once, and the number of triangles at each, (k,)."""
    sides = np.sort(half_edges(triangles), axis=1).astype(np.int64)
    # As one number each, which numpy sorts much faster than pairs.
    size = int(sides.max(initial=0)) + 1
    keys, counts = np.unique(sides[:, 0] * size + sides[:, 1], return_counts=True)
    return np.stack([keys // size, keys % size], axis=1).astype(np.int32), counts


def components(edges: Int32, n: int) -> Int32:
    """Return the number of the connected piece of each of n vertices, (n,), by the edges (k, 2)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(edges), np.int8), tuple(edges.T)), (n, n))
    return np.asarray(connected_components(graph, directed=False)[1], np.int32)


def flat_cross(a: Float64, b: Float64) -> Float64:
    """Return the cross products (...) of vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def edge_graph(at: Float64, edges: Int32) -> Any:
    """Return the lengths of edges (k, 2), which may repeat, as a sparse matrix (n, n), each once."""
    from scipy.sparse import csr_matrix

    edges = np.unique(np.sort(edges, axis=1), axis=0)
    length = np.maximum(np.linalg.norm(at[edges[:, 0]] - at[edges[:, 1]], axis=1), 1e-7)
    return csr_matrix((length, (edges[:, 0], edges[:, 1])), (len(at),) * 2)


def neighbour_mean(n: int, edges: Int32, own: bool = True) -> Any:
    """Return the sparse matrix (n, n) that takes the mean over a vertex's neighbours.

    Args:
        edges: (k, 2), which may repeat.
        own: count the vertex itself, too.
    """
    import scipy.sparse as sp

    i, j = edges.T
    near = sp.csr_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), (n, n))
    near.data[:] = 1
    if own:
        near = near + sp.eye_array(n, format="csr")
    return sp.csr_matrix(sp.diags_array(1 / np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)) @ near)


def triangle_normals(at: Float64, triangles: Int32) -> Float64:
    """Return the normals (m, 3) of triangles, each as long as twice its area."""
    a, b, c = (at[triangles[:, k]] for k in range(3))
    return np.asarray(np.cross(b - a, c - a))


def vertex_normals(at: Float64, triangles: Int32) -> Float64:
    """Return unit normals (n, 3), area weighted; zero for a vertex without triangles."""
    faces, out = triangle_normals(at, triangles), np.zeros_like(at)
    for k in range(3):
        np.add.at(out, triangles[:, k], faces)
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-20))


def mirror_twins(at: Float64, within: float) -> Int32:
    """Return the vertex (n,) within that distance of each vertex's mirror image, or -1."""
    from scipy.spatial import cKDTree

    off, twin = cKDTree(at).query(at * [-1, 1, 1])
    return np.where(np.asarray(off) < within, twin, -1).astype(np.int32)


def nearest_vertex(at: Float64, place: Any, part: tuple[int, int]) -> int:
    """Return the vertex of a part (first, last + 1) that is nearest to a place (3,)."""
    first, last = part
    return first + int(np.argmin(np.linalg.norm(at[first:last] - place, axis=1)))


def nearest_points(corners: Float64, at: Float64) -> Float64:
    """Return the points (n, k, 3) of triangles, whose corners are (n, k, 3, 3), nearest to places (n, 3)."""
    from trimesh import triangles

    closest: Any = triangles.closest_point
    many = np.repeat(FINE * at, corners.shape[1], axis=0)
    return np.asarray(closest(FINE * corners.reshape(-1, 3, 3), many).reshape(*corners.shape[:3]) / FINE)


def corner_shares(corners: Float64, at: Float64) -> Float64:
    """Return the shares (n, 3) of the corners (n, 3, 3) of triangles in places (n, 3) on them."""
    from trimesh import triangles

    shares: Any = triangles.points_to_barycentric
    out = np.clip(shares(corners, at), 0, 1)
    return np.asarray(out / out.sum(axis=1)[:, None])


def fit_ball(at: Float64) -> tuple[Float64, float]:
    """Return centre (3,) and radius of the ball that fits vertices (n, 3) best."""
    rows = np.c_[2 * at, np.ones(len(at))]
    fit = np.linalg.lstsq(rows, (at**2).sum(axis=1), rcond=None)[0]
    return fit[:3], float(np.sqrt(max(fit[3] + fit[:3] @ fit[:3], 1e-12)))
