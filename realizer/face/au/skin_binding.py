"""The vertices that action units move, and the skin that hair and lashes are attached to."""

from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64, Int32
from realizer.face.mesh_geometry import edge_graph, half_edges, part_triangles
from realizer.face.model import Face

# All other parts of a face move with the head alone, or grow on the skin.
MOVED, GROWN = ("skin", "hair"), ("brows", "lashes", "tears")
NEAR = 0.0015  # m; closer parts grow on the skin
AROUND = 16  # number of nearest triangles to look at


def skin(face: Face) -> Bool:
    """Return which vertices (n,) units move directly; what grows on the skin follows it."""
    mine = np.zeros(len(face.vertices), bool)
    for part in MOVED:
        if part in face.parts:
            mine[slice(*face.parts[part])] = True
    return mine


def attached_parts(face: Face) -> list[tuple[int, int, Int32, Float64]]:
    """Return the parts that grow on the skin: first and last vertex, and their `skin_roots`."""
    return [(*face.parts[part], *skin_roots(face, part)) for part in GROWN if part in face.parts]


def skin_roots(face: Face, part: str) -> tuple[Int32, Float64]:
    """Return three vertices of skin for each vertex of the part, (n, 3), and their shares, (n, 3).

    Vertices off the skin, such as a lash's tip, follow the nearest vertex of the part that is on the skin.
    """
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree
    from trimesh import triangles

    skin = part_triangles(face.triangles, face.parts["skin"]) + face.parts["skin"][0]
    corners = face.vertices[skin].astype(np.float64)
    first, last = face.parts[part]
    at = face.vertices[first:last].astype(np.float64)
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(at, min(AROUND, len(skin)))[1]).reshape(len(at), -1)
    many = np.repeat(at, near.shape[1], axis=0)
    nearest: Any = triangles.closest_point
    shares: Any = triangles.points_to_barycentric
    places = nearest(corners[near.ravel()], many).reshape(*near.shape, 3)
    off = np.linalg.norm(places - at[:, None], axis=2)
    best = off.argmin(axis=1)
    each = np.arange(len(at))
    hit, place, off = near[each, best], places[each, best], off[each, best]
    share = np.clip(shares(corners[hit], place), 0, 1)
    # Parts far from the skin are bound to their nearest place on it as well.
    edges = half_edges(part_triangles(face.triangles, face.parts[part]))
    attached = np.flatnonzero(off < NEAR)
    root = each.copy()
    if len(attached) and len(edges):
        graph = edge_graph(at, edges)
        away, _, source = dijkstra(
            graph, directed=False, indices=attached, min_only=True, return_predecessors=True
        )
        root[np.isfinite(away)] = source[np.isfinite(away)]
    return skin[hit[root]], np.asarray(share[root] / share[root].sum(axis=1)[:, None])
